"""The catalogue of effects: every module below this folder that defines `EFFECT` is one.

Adding an effect is adding a file; the simulator, the fits and the diagnosis read it from here.
The file may lie elsewhere: `FREESWING_EFFECTS` names folders of further ones.
"""

from __future__ import annotations

import os
from functools import cache
from importlib import import_module
from pkgutil import walk_packages

from freeswing.cdpr.effects.base import Clues, Effect, Experiment, Instant, Parameter, Recorded
from freeswing.cdpr.effects.own_folders import effects_in

__all__ = [
    "Clues",
    "Effect",
    "Experiment",
    "Instant",
    "Parameter",
    "Recorded",
    "catalogue",
    "driven_catalogue",
    "effect_named",
]
FOLDERS = "FREESWING_EFFECTS"


def catalogue() -> dict[str, Effect]:
    """The effects that a free swing may have, by name in alphabetical order.

    Raises:
        InputError: for a folder in FREESWING_EFFECTS that is none, or a file there that defines
            no effect, a broken one, or one whose name is taken.
    """
    return {name: effect for name, effect in _known().items() if effect.on_free}


def driven_catalogue() -> dict[str, Effect]:
    """The effects that a robot moved by motors may have, by name in alphabetical order.

    Raises:
        InputError: as `catalogue`.
    """
    return {name: effect for name, effect in _known().items() if effect.on_driven}


def _known() -> dict[str, Effect]:
    return _catalogue(os.environ.get(FOLDERS, ""))


@cache
def _catalogue(folders: str) -> dict[str, Effect]:
    modules = (import_module(info.name) for info in walk_packages(__path__, f"{__name__}."))
    effects = [module.EFFECT for module in modules if hasattr(module, "EFFECT")]
    for folder in filter(None, folders.split(os.pathsep)):
        effects += effects_in(folder, {effect.name for effect in effects})
    return {effect.name: effect for effect in sorted(effects, key=lambda e: e.name)}


def effect_named(name: str) -> Effect:
    """The effect of that name, of free swings or of driven robots.

    Raises:
        ValueError: when there is none, naming those that there are.
    """
    known = _known()
    if name not in known:
        raise ValueError(f"no effect is called {name!r}; there are {', '.join(known)}")
    return known[name]
