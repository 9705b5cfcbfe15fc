"""ROS camera_info yaml: one camera a file, lens only (no pose, no clock)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
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
)
from freeswing.calib.exchange.plain_yaml import load_yaml
from freeswing.cdpr.files.documents import InputError, replace_file

_FISHEYES = ("equidistant", "fisheye")
_KNOWN = "plumb_bob, rational_polynomial or equidistant"


def read(path: Path, tell: Callable[[str], None]) -> tuple[Camera, ...]:
    """The camera of a file, or all cameras of a folder's *.yaml, at the identity pose."""
    files = sorted(path.glob("*.yaml")) if path.is_dir() else [path]
    if not files:
        raise InputError(f"{path}: holds no *.yaml")
    cameras = tuple(_read_one(file) for file in files)
    if len(cameras) > 1:
        tell(f"{path}: holds no poses: all its cameras stand at the origin")
    names = [camera.name for camera in cameras]
    if len(set(names)) == len(names):
        return cameras
    tell(f"{path}: cameras share the name {names[0]!r}: they are named as their files")
    return tuple(replace(c, name=f.stem) for c, f in zip(cameras, files, strict=True))


def _refuse_part(entry: dict[str, Any]) -> None:
    """Passes pictures of the whole sensor, pixel by pixel."""
    area = entry.get("roi") or {}
    binned = max(int(entry.get(key, 0)) for key in ("binning_x", "binning_y")) > 1
    if binned or any(int(area.get(key, 0)) for key in ("x_offset", "y_offset", "width", "height")):
        raise InputError(
            "binning or roi: camera_matrix is the whole sensor's, and the picture is not; "
            "calibrate with the pictures as they are recorded"
        )


def _read_one(path: Path) -> Camera:
    entry = load_yaml(path)
    try:
        focal, centre = of_matrix(entry["camera_matrix"]["data"])
        coefficients = np.array(entry["distortion_coefficients"]["data"], dtype=np.float64)
        kind = str(entry["distortion_model"])
        if kind not in (*_FISHEYES, "plumb_bob", "rational_polynomial", "none", ""):
            raise InputError(f"distortion_model {kind!r} is not {_KNOWN}")
        _refuse_part(entry)
        size = (int(entry["image_width"]), int(entry["image_height"]))
        model, params = lens(focal, centre, coefficients, fisheye=kind in _FISHEYES)
        return Camera(str(entry.get("camera_name", path.stem)), size, model, params, np.eye(4))
    except ODD_ENTRY as error:
        raise InputError(f"{path}: not a ROS camera_info file ({error})") from error


def write(path: Path, cameras: Sequence[Camera]) -> None:
    """One file for one camera, else a folder with `<camera>.yaml`; poses are not stored."""
    if len(cameras) == 1 and path.suffix:
        replace_file(path, _text(cameras[0]).encode())
        return
    for camera in cameras:
        if Path(camera.name).name != camera.name:
            raise InputError(f"camera {camera.name!r} becomes a file name: rename it")
        replace_file(path / f"{camera.name}.yaml", _text(camera).encode())


def _text(camera: Camera) -> str:
    if camera.model == FISHEYE:
        kind, coefficients = "equidistant", distortion(camera)
    else:
        coefficients = shortest(distortion(camera), (5, 8))
        kind = "plumb_bob" if len(coefficients) == 5 else "rational_polynomial"
    K = matrix(camera)
    P = np.column_stack([K, np.zeros(3)])
    parts = [
        f"image_width: {camera.size_px[0]}",
        f"image_height: {camera.size_px[1]}",
        f"camera_name: {camera.name}",
        *_matrix("camera_matrix", K),
        f"distortion_model: {kind}",
        *_matrix("distortion_coefficients", coefficients[None]),
        *_matrix("rectification_matrix", np.eye(3)),
        *_matrix("projection_matrix", P),
    ]
    return "\n".join(parts) + "\n"


def _matrix(key: str, values: np.ndarray) -> list[str]:
    rows, columns = values.shape
    return [
        f"{key}:",
        f"  rows: {rows}",
        f"  cols: {columns}",
        f"  data: {values.ravel().tolist()}",
    ]
