"""Anipose's and Caliscope's calibration toml.

Lengths are those of the board's drawing, metres or millimetres: a rig that would be hundreds of
metres across is taken for one in millimetres, and that is said.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import FISHEYE
from freeswing.calib.exchange.matrix_and_distortion import (
    ODD_ENTRY,
    distortion,
    lens,
    matrix,
    of_matrix,
    shortest,
    usable,
)
from freeswing.calib.exchange.metres_or_millimetres import in_metres
from freeswing.cdpr.files.documents import InputError, dump_toml, read_text
from freeswing.cdpr.rotation import exp_rotation, log_rotation, transform

_MOST_BYTES = 1 << 24


def read(path: Path, tell: Callable[[str], None]) -> tuple[Camera, ...]:
    """Cameras of `[cam_0]` tables (Anipose) or `[cameras.0]` tables (Caliscope)."""
    try:
        document = tomllib.loads(read_text(path, _MOST_BYTES))
    except (tomllib.TOMLDecodeError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: not toml: {error}") from error
    tables = document.get("cameras", document)
    entries = [(k, v) for k, v in tables.items() if isinstance(v, dict) and "matrix" in v]
    if not entries:
        raise InputError(f"{path}: holds no camera with a matrix")
    posed = [(key, entry) for key, entry in entries if _has_pose(entry)]
    for key, entry in entries if posed else ():
        if not _has_pose(entry):
            tell(f"{path}: {_name(key, entry)} has no pose: left out")
    cameras = []
    for key, entry in posed or entries:
        try:
            cameras.append(_camera(key, entry))
        except ODD_ENTRY as error:
            raise InputError(f"{path}: {key}: {error}") from error
    return in_metres(path, tuple(cameras), tell)


def _has_pose(entry: dict[str, Any]) -> bool:
    return "rotation" in entry and "translation" in entry and not entry.get("ignore", False)


def _name(key: str, entry: dict[str, Any]) -> str:
    return str(entry.get("name", entry.get("cam_id", key)))


def _camera(key: str, entry: dict[str, Any]) -> Camera:
    if int(entry.get("rotation_count", 0)) % 4:
        raise InputError(
            f"rotation_count = {entry['rotation_count']}: its picture is turned by quarters before "
            "it is shown, and whether lens and pose are of the turned one the file does not say: "
            "turn the recordings, calibrate them with rotation_count = 0"
        )
    focal, centre = of_matrix(entry["matrix"])
    fisheye = bool(entry.get("fisheye", False))
    coefficients = np.array(entry["distortions"], dtype=np.float64)
    model, params = lens(focal, centre, coefficients, fisheye=fisheye)
    turn = usable(entry.get("rotation", np.zeros(3)), "rotation")
    R = turn.reshape(3, 3) if turn.size == 9 else exp_rotation(turn.reshape(3))
    shift = usable(entry.get("translation", np.zeros(3)), "translation").reshape(3)
    width, height = (int(size) for size in entry["size"])
    return Camera(_name(key, entry), (width, height), model, params, transform(R, shift))


def write(path: Path, cameras: Sequence[Camera]) -> None:
    """Anipose's layout, which Caliscope reads too."""
    table: dict[str, Any] = {}
    for index, camera in enumerate(cameras):
        is_fisheye = camera.model == FISHEYE
        coefficients = distortion(camera) if is_fisheye else shortest(distortion(camera), (5, 8))
        table[f"cam_{index}"] = {
            "name": camera.name,
            "size": list(camera.size_px),
            "matrix": matrix(camera).tolist(),
            "distortions": coefficients.tolist(),
            "rotation": log_rotation(camera.T_camera_base[:3, :3]).tolist(),
            "translation": camera.T_camera_base[:3, 3].tolist(),
            "fisheye": is_fisheye,
        }
    table["metadata"] = {"adjusted": True}
    dump_toml(path, table)
