"""Compiled kernels: which came with the program, which are kept here, whether new ones can be."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

from freeswing.cdpr.compiled import kernels
from freeswing.doctor.finding import Finding


def kernel_findings() -> Iterator[Finding]:
    """What the first run in this environment need not compile."""
    ready = _files(kernels.READY)
    fitting = [path for path in ready if kernels.made_for(path)]
    text, remedy = f"{len(ready)} came with the program ({_megabytes(ready)})", ""
    if not ready:
        text = "none came with the program"
    elif not kernels.levels_here():
        text += f", not used: they need a processor of level {list(kernels.LEVELS)[-1]}"
    elif not fitting:
        text += ", not used: they are for other versions of Python, numba, llvmlite or numpy"
        remedy = "install with the release's requirements.lock"
    elif not kernels.comes_ready():
        text += ", not used: NUMBA_CACHE_DIR is set"
    yield Finding("note", "kernels that are ready", text, remedy)
    yield _kept(bool(fitting) and kernels.comes_ready())


def _kept(is_ready: bool) -> Finding:
    """Those that were compiled here."""
    folder = kernels.user_folder()
    kept = _files(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError:
        text = f"{folder} cannot be written to: kernels are compiled again in every process"
        return Finding("warning", "kernels", text, "set NUMBA_CACHE_DIR to a folder of your own")
    text = f"{len(kept)} compiled ones kept in {folder} ({_megabytes(kept)})"
    if is_ready or kept:
        return Finding("note", "kernels", text)
    text += "; the first track or demo compiles them, about a minute"
    return Finding("note", "kernels", text, "freeswing doctor --compile does so ahead")


def _files(folder: Path) -> list[Path]:
    return list(folder.glob(f"*{kernels.SUFFIX}"))


def _megabytes(files: list[Path]) -> str:
    return f"{1e-6 * sum(path.stat().st_size for path in files):.1f} MB"
