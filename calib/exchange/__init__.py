"""Cameras to and from other programs' files."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from pathlib import Path

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import read_cameras, write_cameras
from freeswing.calib.exchange.impossible_cameras import refuse_impossible
from freeswing.cdpr.files.documents import InputError

FORMATS = ("freeswing", "opencv", "kalibr", "ros", "anipose", "colmap", "colmap-binary", "qualisys")
Tell = Callable[[str], None]
_LOOKED_AT_BYTES = 20_000
_MODULES = {
    "opencv": "opencv_yaml",
    "kalibr": "kalibr",
    "ros": "ros",
    "anipose": "anipose",
    "colmap": "colmap",
    "colmap-binary": "colmap_binary",
    "qualisys": "qualisys",
}


def read(path: Path | str, kind: str | None = None, tell: Tell | None = None) -> tuple[Camera, ...]:
    """Cameras from a file (COLMAP, several ROS cameras: a folder) of another program.

    Args:
        path: the file or folder.
        kind: one of `FORMATS`; guessed from name and content when None.
        tell: told what was left out, and what was taken for what.

    Raises:
        InputError: when it cannot be read as such.
    """
    path = Path(path)
    kind = kind or guess(path)
    if kind == "freeswing":
        return read_cameras(path)
    cameras = _module(kind).read(path, tell or _nobody)
    refuse_impossible(path, cameras)
    return cameras


def write(path: Path | str, cameras: Sequence[Camera], kind: str) -> None:
    """Cameras as another program's file; its pixel convention and units are kept.

    Raises:
        InputError: when the format cannot hold the lens.
    """
    if kind == "freeswing":
        write_cameras(path, tuple(cameras))
        return
    _module(kind).write(Path(path), cameras)


def guess(path: Path) -> str:
    """The format of a file or folder.

    Raises:
        InputError: when nothing known is there.
    """
    if path.is_dir():
        if (path / "cameras.txt").is_file():
            return "colmap"
        return "colmap-binary" if (path / "cameras.bin").is_file() else "ros"
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    with path.open("rb") as file:
        start = file.read(_LOOKED_AT_BYTES).decode(errors="replace")
    signs = (
        ("freeswing", 'format = "freeswing-cameras'),
        ("opencv", "!!opencv-matrix"),
        ("opencv", "<opencv_storage"),
        ("qualisys", "<calibration"),
        ("ros", "camera_matrix:"),
        ("kalibr", "intrinsics:"),
        ("anipose", "distortions"),
    )
    for kind, sign in signs:
        if sign in start:
            return kind
    if path.name == "cameras.txt":
        return "colmap"
    raise InputError(f"{path}: not a camera file known here; name the format: {', '.join(FORMATS)}")


def _nobody(text: str) -> None:
    """Tells nobody."""


def _module(kind: str):
    if kind not in _MODULES:
        raise InputError(f"camera format {kind!r} is not one of {', '.join(FORMATS)}")
    return importlib.import_module(f"freeswing.calib.exchange.{_MODULES[kind]}")
