"""Anipose's and Caliscope's calibration toml.

Lengths are those of the board's drawing, metres or millimetres: a rig that would be hundreds of
metres across is taken for one in millimetres, and that is said.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import FISHEYE
from freeswing.calib.exchange.lens import ODD_ENTRY, distortion, lens, matrix, shortest, usable
from freeswing.cdpr.files.documents import InputError, dump_toml, read_text
from freeswing.cdpr.rotation import exp_rotation, log_rotation, transform

_MOST_BYTES = 1 << 24
FARTHEST_M = 60.0
"""Laboratories are smaller; in millimetres it would be 6 cm, and no rig is that small."""


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
    return _in_metres(path, tuple(cameras), tell)


def _has_pose(entry: dict[str, Any]) -> bool:
    return "rotation" in entry and "translation" in entry and not entry.get("ignore", False)


def _name(key: str, entry: dict[str, Any]) -> str:
    return str(entry.get("name", entry.get("cam_id", key)))


def _in_metres(
    path: Path, cameras: tuple[Camera, ...], tell: Callable[[str], None]
) -> tuple[Camera, ...]:
    farthest = max(float(np.linalg.norm(camera.position_base_m)) for camera in cameras)
    if farthest < FARTHEST_M:
        return cameras
    tell(
        f"{path}: cameras up to {farthest:.4g} units from the origin: taken for millimetres "
        f"({1e-3 * farthest:.3g} m)"
    )
    poses = [transform(c.T_camera_base[:3, :3], 1e-3 * c.T_camera_base[:3, 3]) for c in cameras]
    return tuple(replace(c, T_camera_base=T) for c, T in zip(cameras, poses, strict=True))


def _camera(key: str, entry: dict[str, Any]) -> Camera:
    if int(entry.get("rotation_count", 0)) % 4:
        raise InputError(
            f"rotation_count = {entry['rotation_count']}: its picture is turned by quarters before "
            "it is shown, and whether lens and pose are of the turned one the file does not say: "
            "turn the recordings, calibrate them with rotation_count = 0"
        )
    K = np.array(entry["matrix"], dtype=np.float64).reshape(3, 3)
    fisheye = bool(entry.get("fisheye", False))
    coefficients = np.array(entry["distortions"], dtype=np.float64)
    model, params = lens(K[[0, 1], [0, 1]], K[:2, 2], coefficients, fisheye=fisheye)
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
