"""The machine examined: versions, codecs, cores, memory, kernels, cluster, what else is there."""

from __future__ import annotations

import importlib
import os
import platform
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Literal

from freeswing import __version__
from freeswing.console import has_desktop
from freeswing.doctor.finding import Finding
from freeswing.doctor.kept_kernels import kernel_findings

# Distribution and module of what every command rests on; without one of them something fails.
NEEDED = {
    "numpy": "numpy",
    "scipy": "scipy",
    "casadi": "casadi",
    "numba": "numba",
    "opencv-contrib-python-headless": "cv2",
    "av": "av",
    "matplotlib": "matplotlib",
    "ezc3d": "ezc3d",
    "pycolmap": "pycolmap",
    "trimesh": "trimesh",
    "rich": "rich",
    "shtab": "shtab",
}
# What an extra adds, and what it is for.
EXTRAS = {
    "distributed": "freeswing[cluster]: --cluster",
    "rerun-sdk": "freeswing[view]: track --view",
    "slycot": "freeswing[control]: design beside slycot",
    "pandas": "to_dataframe() in Python",
    "arviz": "to_arviz() in Python",
}
READ = ("h264", "hevc", "mjpeg", "vp9", "av1", "ffv1")  # what phones and cameras write
WRITTEN = ("libx264", "ffv1", "magicyuv")  # overlays, recordings, the demonstration
# A tracked run of a minute by three cameras takes 0.6 GB, and two run side by side.
COMFORTABLE_GB = 2.0


def machine_findings() -> Iterator[Finding]:
    """What this machine has, each an error where something cannot work without it."""
    yield Finding("note", "freeswing", f"{__version__} in {Path(__file__).parents[1]}")
    yield Finding("note", "python", f"{platform.python_version()} on {platform.platform()}")
    for distribution, module in NEEDED.items():
        yield _needed(distribution, module)
    for distribution, use in EXTRAS.items():
        yield _extra(distribution, use)
    yield from _codecs()
    yield _cores()
    yield _memory()
    yield from kernel_findings()
    told = "there is one" if has_desktop() else "none: open pages yourself"
    yield Finding("note", "desktop", told)


def cluster_finding(address: str) -> Finding:
    """Whether a Dask cluster answers and sees this folder."""
    from freeswing.cdpr.files.problems import InputError
    from freeswing.workers.cluster import connected

    try:
        with connected(address, Path.cwd(), Path.cwd()):
            return Finding("note", "cluster", f"{address} answers, of the same version")
    except InputError as failure:
        return Finding("error", "cluster", str(failure))


def _needed(distribution: str, module: str) -> Finding:
    try:
        importlib.import_module(module)
        return Finding("note", distribution, version(distribution))
    except (ImportError, OSError) as failure:
        return Finding(
            "error", distribution, f"cannot be loaded: {failure}", f"pip install {distribution}"
        )


def _extra(distribution: str, use: str) -> Finding:
    try:
        return Finding("note", distribution, version(distribution))
    except PackageNotFoundError:
        return Finding("note", distribution, f"not installed ({use})")


def _codecs() -> Iterator[Finding]:
    try:
        from av.codec import Codec
        from av.error import FFmpegError
    except ImportError:
        return  # said above
    ways: tuple[tuple[Literal["r", "w"], tuple[str, ...], str], ...] = (
        ("r", READ, "read"),
        ("w", WRITTEN, "write"),
    )
    for mode, names, what in ways:
        absent = []
        for name in names:
            try:
                Codec(name, mode)
            except (FFmpegError, ValueError):
                absent.append(name)
        if absent:
            text = f"cannot {what} {', '.join(absent)}"
            yield Finding("warning", "codecs", text, "convert such films, or install another av")
        else:
            yield Finding("note", "codecs", f"can {what} {', '.join(names)}")


def _cores() -> Finding:
    here = getattr(os, "sched_getaffinity", lambda _: range(os.cpu_count() or 1))(0)
    return Finding("note", "cores", f"{len(here)} for --workers")


def _memory() -> Finding:
    try:
        size = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    except (ValueError, OSError, AttributeError):
        return Finding("note", "memory", "not told by this system")
    if size < COMFORTABLE_GB:
        text = f"{size:.1f} GB, {COMFORTABLE_GB:g} are comfortable"
        return Finding("warning", "memory", text, "give --workers 1, or shorter films")
    return Finding("note", "memory", f"{size:.1f} GB")
