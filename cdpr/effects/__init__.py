"""The catalogue of effects: every module below this folder that defines `EFFECT` is one.

Adding an effect is adding a file; the simulator, the fits and the diagnosis read it from here.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import walk_packages

from freeswing.cdpr.effects.base import Effect, Instant, Parameter

__all__ = ["Effect", "Instant", "Parameter", "catalogue", "effect_named"]


@cache
def catalogue() -> dict[str, Effect]:
    """Every effect by name, in alphabetical order."""
    modules = (import_module(info.name) for info in walk_packages(__path__, f"{__name__}."))
    effects = (module.EFFECT for module in modules if hasattr(module, "EFFECT"))
    return {effect.name: effect for effect in sorted(effects, key=lambda e: e.name)}


def effect_named(name: str) -> Effect:
    """The effect of that name.

    Raises:
        ValueError: when there is none, naming those that there are.
    """
    known = catalogue()
    if name not in known:
        raise ValueError(f"no effect is called {name!r}; there are {', '.join(known)}")
    return known[name]
