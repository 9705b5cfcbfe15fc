"""Cameras from one program's file to another's, and what is lost on the way."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from freeswing.calib import exchange
from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.files.documents import InputError

# What a name says of a format; other names of these kinds are several programs'.
_ENDINGS = {".qca.txt": "qualisys", ".xml": "qualisys"}
_NAMES = {"cameras.toml": "freeswing", "camchain.yaml": "kalibr", "calibration.toml": "anipose"}
_FOLDERS = ("colmap", "ros")
_SAME_POSE = 1e-6


def convert_cameras(
    source: Path, result: Path, source_kind: str | None, result_kind: str | None
) -> list[str]:
    """Read, write, read back; gives a sentence for each thing that the new file cannot hold.

    Args:
        source: file or folder.
        result: file, or for COLMAP and several ROS cameras a folder.
        source_kind: format of the source, guessed when None.
        result_kind: format of the result, from its name when None.

    Raises:
        InputError: a kind that is not told, a lens that the format cannot hold, a name that does
            not suit it.
    """
    said: list[str] = []
    cameras = exchange.read(source, source_kind, said.append)
    kind = result_kind or kind_of_name(result)
    _check_name(result, kind, len(cameras))
    exchange.write(result, cameras, kind)
    return said + _losses(cameras, exchange.read(result, kind), kind)


def kind_of_name(path: Path) -> str:
    """The camera format that a file to be written has by its name.

    Raises:
        InputError: where several formats have such names.
    """
    name = path.name.lower()
    if name in _NAMES:
        return _NAMES[name]
    for ending, kind in _ENDINGS.items():
        if name.endswith(ending):
            return kind
    raise InputError(
        f"{path}: its name does not tell the camera format: add --to with one of "
        f"{', '.join(exchange.FORMATS)}"
    )


def _check_name(path: Path, kind: str, count: int) -> None:
    """A folder where the format is one, a file where it is not."""
    is_folder = kind == "colmap" or (kind == "ros" and count > 1)
    if is_folder and (path.suffix or path.is_file()):
        several = f" of {count} cameras" if count > 1 else ""
        raise InputError(f"{path}: {kind}{several} is a folder; give a name without an ending")
    if not is_folder and path.is_dir():
        raise InputError(f"{path}: is a folder; {kind} is one file")


def _losses(before: Sequence[Camera], after: Sequence[Camera], kind: str) -> list[str]:
    """What the cameras had and the file that was written no longer tells."""
    found = {camera.name: camera for camera in after}
    pairs = [(camera, found[camera.name]) for camera in before if camera.name in found]
    said = []
    if len(pairs) < len(before):
        said.append(f"{kind} names cameras in its own way: {', '.join(found)}")
        pairs = list(zip(before, after, strict=True))
    moved = [np.abs(a.T_camera_base - b.T_camera_base).max() for a, b in pairs]
    if max(moved) > _SAME_POSE:
        said.append(f"{kind} holds no poses: they are left out")
    late = max(abs(a.clock_offset_s - b.clock_offset_s) for a, b in pairs)
    if late > 0.0:
        said.append(f"{kind} holds no clocks: offsets of up to {1e3 * late:.3g} ms are left out")
    if any(a.line_time_s != b.line_time_s for a, b in pairs):
        said.append(f"{kind} holds no rolling shutters: line times are left out")
    return said
