"""Effects in folders of the user's own: each Python file defines one `EFFECT`."""

from __future__ import annotations

from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from freeswing.cdpr.effects.base import Effect
from freeswing.cdpr.files.problems import InputError

# What a file that is not fit for use raises when it is read: a typing error, a missing module, a
# name or an attribute that does not exist, a wrong call.
BROKEN = (SyntaxError, ImportError, NameError, AttributeError, TypeError, ValueError)


def effects_in(folder: str | Path, taken: set[str]) -> list[Effect]:
    """The effects of a folder, in the order of their files; those that begin with _ are passed by.

    Raises:
        InputError: where the folder, a file in it or an effect's name cannot serve.
    """
    path = Path(folder)
    if not path.is_dir():
        raise InputError(f"FREESWING_EFFECTS: {path} is not a folder")
    found: list[Effect] = []
    for file in sorted(path.glob("[!_]*.py")):
        one = _effect_in(file)
        if one.name in taken or one.name in {other.name for other in found}:
            raise InputError(f"{file}: there is already an effect named {one.name!r}; rename it")
        found.append(one)
    return found


def _effect_in(file: Path) -> Effect:
    spec = spec_from_file_location(f"freeswing_effects_{file.stem}", file)
    if spec is None or spec.loader is None:
        raise InputError(f"{file}: cannot be read as Python")
    module = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except BROKEN as error:
        raise InputError(f"{file}: {type(error).__name__}: {error}") from error
    effect = getattr(module, "EFFECT", None)
    if not isinstance(effect, Effect) or not effect.name:
        raise InputError(f"{file}: defines no EFFECT (an instance of an Effect that has a name)")
    return effect
