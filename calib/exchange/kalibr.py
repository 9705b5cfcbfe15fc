"""Kalibr's camchain.yaml, and TagSLAM's cameras.yaml, which looks alike.

The base frame takes the part of Kalibr's IMU: `T_cam_imu` holds T_camera_base and
`timeshift_cam_imu` the clock offset (t_imu = t_cam + shift). A chain without them starts at its
first camera. Kalibr's pixel (0, 0) is the centre of the top-left pixel, as here.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import FISHEYE
from freeswing.calib.exchange.lens import ODD_ENTRY, distortion, lens, shortest, usable
from freeswing.calib.exchange.plain_yaml import load_yaml
from freeswing.cdpr.files.documents import InputError, replace_file
from freeswing.cdpr.rotation import invert


def read(path: Path) -> tuple[Camera, ...]:
    """Cameras cam0, cam1, ... of the chain."""
    document = load_yaml(path)
    entries = [(k, v) for k, v in document.items() if isinstance(v, dict) and "intrinsics" in v]
    if not entries:
        raise InputError(f"{path}: holds no camera with intrinsics")
    cameras: list[Camera] = []
    for name, entry in entries:
        try:
            cameras.append(_camera(str(name), entry, cameras))
        except ODD_ENTRY as error:
            raise InputError(f"{path}: {name}: {error}") from error
    return tuple(cameras)


def _camera(key: str, entry: dict[str, Any], before: Sequence[Camera]) -> Camera:
    if entry.get("camera_model", "pinhole") != "pinhole":
        raise InputError(f"camera_model {entry['camera_model']!r} is not pinhole")
    kind = str(entry.get("distortion_model", "none"))
    if kind not in ("radtan", "plumb_bob", "equidistant", "none"):
        raise InputError(f"distortion_model {kind!r} is not radtan, equidistant or none")
    values = np.array(entry["intrinsics"], dtype=np.float64)
    coefficients = np.array(entry.get("distortion_coeffs", []), dtype=np.float64)
    model, params = lens(values[:2], values[2:4], coefficients, fisheye=kind == "equidistant")
    if "T_cam_imu" in entry:
        T = usable(entry["T_cam_imu"], "T_cam_imu")
    elif "T_cn_cnm1" in entry and before:
        T = usable(entry["T_cn_cnm1"], "T_cn_cnm1") @ before[-1].T_camera_base
    else:
        T = np.eye(4)
    topic = str(entry.get("rostopic", "")).strip("/").split("/")
    name = topic[-2] if len(topic) > 1 else key
    width, height = (int(size) for size in entry["resolution"])
    offset = float(entry.get("timeshift_cam_imu", 0.0))
    return Camera(
        name, (width, height), model, params, T, offset, float(entry.get("line_delay", 0))
    )


def write(path: Path, cameras: Sequence[Camera]) -> None:
    """The cameras as a chain, in their order."""
    lines: list[str] = []
    for index, camera in enumerate(cameras):
        is_fisheye = camera.model == FISHEYE
        coefficients = distortion(camera) if is_fisheye else shortest(distortion(camera), (4,))
        lines += [
            f"cam{index}:",
            "  camera_model: pinhole",
            f"  distortion_coeffs: {coefficients.tolist()}",
            f"  distortion_model: {'equidistant' if is_fisheye else 'radtan'}",
            f"  intrinsics: {[*camera.focal_px.tolist(), *camera.centre_px.tolist()]}",
            f"  resolution: {list(camera.size_px)}",
            f"  rostopic: /{camera.name}/image_raw",
            f"  timeshift_cam_imu: {camera.clock_offset_s!r}",
            f"  line_delay: {camera.line_time_s!r}",
            *_matrix("T_cam_imu", camera.T_camera_base),
        ]
        if index:
            chain = camera.T_camera_base @ invert(cameras[index - 1].T_camera_base)
            lines += _matrix("T_cn_cnm1", chain)
    replace_file(path, ("\n".join(lines) + "\n").encode())


def _matrix(key: str, T: np.ndarray) -> list[str]:
    return [f"  {key}:", *(f"  - {row}" for row in T.tolist())]
