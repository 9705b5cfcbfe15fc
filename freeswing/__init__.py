"""The front door: session files, commands and the report."""

from pathlib import Path
from typing import Any

__version__ = "0.1.0"

if not (Path(__file__).parent / "cdpr").is_dir():
    raise ImportError(
        "freeswing/cdpr and its neighbours are symbolic links to folders beside freeswing/, but "
        "files in this checkout: git config core.symlinks true, then git checkout -- freeswing"
    )


def __getattr__(name: str) -> Any:
    """The names of `freeswing.front`, loaded when they are first asked for."""
    from importlib import import_module

    front = import_module("freeswing.front") if not name.startswith("_") else None
    if front is None or name not in front.__all__:
        raise AttributeError(f"module 'freeswing' has no attribute {name!r}")
    return getattr(front, name)
