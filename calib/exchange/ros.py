"""ROS camera_info yaml: one camera a file, lens only (no pose, no clock)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import FISHEYE
from freeswing.calib.exchange.lens import ODD_ENTRY, distortion, lens, matrix, shortest
from freeswing.calib.exchange.plain_yaml import load_yaml
from freeswing.cdpr.files.documents import InputError, replace_file


def read(path: Path, tell: Callable[[str], None]) -> tuple[Camera, ...]:
    """The camera of a file, or all cameras of a folder's *.yaml, at the identity pose."""
    files = sorted(path.glob("*.yaml")) if path.is_dir() else [path]
    if not files:
        raise InputError(f"{path}: holds no *.yaml")
    cameras = tuple(_read_one(file) for file in files)
    names = [camera.name for camera in cameras]
    if len(set(names)) == len(names):
        return cameras
    tell(f"{path}: cameras share the name {names[0]!r}: they are named as their files")
    return tuple(replace(c, name=f.stem) for c, f in zip(cameras, files, strict=True))


def _read_one(path: Path) -> Camera:
    entry = load_yaml(path)
    try:
        K = np.array(entry["camera_matrix"]["data"], dtype=np.float64).reshape(3, 3)
        coefficients = np.array(entry["distortion_coefficients"]["data"], dtype=np.float64)
        kind = str(entry["distortion_model"])
        size = (int(entry["image_width"]), int(entry["image_height"]))
        fisheye = kind in ("equidistant", "fisheye")
        model, params = lens(K[[0, 1], [0, 1]], K[:2, 2], coefficients, fisheye=fisheye)
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
