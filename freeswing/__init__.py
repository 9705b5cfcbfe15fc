"""The front door: session files, commands and the report."""

from pathlib import Path

__version__ = "0.1.0"

if not (Path(__file__).parent / "cdpr").is_dir():
    raise ImportError(
        "freeswing/cdpr and its neighbours are symbolic links to folders beside freeswing/, but "
        "files in this checkout: git config core.symlinks true, then git checkout -- freeswing"
    )
