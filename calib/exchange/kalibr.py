"""Kalibr's camchain.yaml, and TagSLAM's cameras.yaml, which looks alike.

The base frame takes the part of Kalibr's IMU: `T_cam_imu` holds T_camera_base and
`timeshift_cam_imu` the clock offset (t_imu = t_cam + shift). A chain without them starts at its
first camera. Kalibr's pixel (0, 0) is the centre of the top-left pixel, as here.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import FISHEYE, Array
from freeswing.calib.exchange.matrix_and_distortion import (
    ODD_ENTRY,
    distortion,
    lens,
    shortest,
    usable,
)
from freeswing.calib.exchange.names import by_number, distinct_names
from freeswing.calib.exchange.plain_yaml import load_yaml
from freeswing.cdpr.files.documents import InputError, replace_file
from freeswing.cdpr.rotation import invert


def read(path: Path, tell: Callable[[str], None]) -> tuple[Camera, ...]:
    """Cameras cam0, cam1, ... of the chain, in the order of their numbers."""
    document = load_yaml(path)
    entries = {str(k): v for k, v in document.items() if isinstance(v, dict) and "intrinsics" in v}
    if not entries:
        raise InputError(f"{path}: holds no camera with intrinsics")
    keys = by_number(list(entries))
    topics = [str(entries[key].get("rostopic", "")).strip("/").split("/") for key in keys]
    no_poses = not any({"T_cam_imu", "T_cn_cnm1"} & set(entry) for entry in entries.values())
    if no_poses and len(entries) > 1:
        tell(f"{path}: holds no poses: all its cameras stand at the origin")
    poses = {key: np.eye(4) for key in keys} if no_poses else _poses(path, keys, entries)
    cameras: list[Camera] = []
    for key, name in zip(keys, distinct_names(topics, keys), strict=True):
        try:
            if key not in poses:
                tell(f"{path}: {key}: nothing joins it to the others: left out")
                continue
            cameras.append(_camera(name, entries[key], poses[key]))
        except ODD_ENTRY as error:
            raise InputError(f"{path}: {key}: {error}") from error
    return tuple(cameras)


def _poses(path: Path, keys: list[str], entries: dict[str, dict[str, Any]]) -> dict[str, Array]:
    """T_cam_base of all that are joined, the links followed both ways.

    The IMU is the base where one camera knows it, else the first camera.
    """
    poses: dict[str, Array] = {}
    links: list[tuple[str, str, Array]] = []
    for before, key in zip([None, *keys], keys, strict=False):
        try:
            if "T_cam_imu" in entries[key]:
                poses[key] = usable(entries[key]["T_cam_imu"], "T_cam_imu").reshape(4, 4)
            if "T_cn_cnm1" in entries[key] and before is not None and _on_end(before, key):
                link = usable(entries[key]["T_cn_cnm1"], "T_cn_cnm1").reshape(4, 4)
                links.append((before, key, link))
        except ODD_ENTRY as error:
            raise InputError(f"{path}: {key}: {error}") from error
    poses = poses or {keys[0]: np.eye(4)}
    for before, key, link in [*links, *links[::-1]]:
        if before in poses and key not in poses:
            poses[key] = link @ poses[before]
        elif key in poses and before not in poses:
            poses[before] = invert(link) @ poses[key]
    return poses


def _on_end(before: str, key: str) -> bool:
    """Whether a camera's number follows the other's: `T_cn_cnm1` is the way from the last one."""
    numbers = [re.findall(r"\d+", name) for name in (before, key)]
    return not all(numbers) or int(numbers[1][-1]) == int(numbers[0][-1]) + 1


def _camera(name: str, entry: dict[str, Any], pose: Array) -> Camera:
    if entry.get("camera_model", "pinhole") != "pinhole":
        raise InputError(f"camera_model {entry['camera_model']!r} is not pinhole")
    kind = str(entry.get("distortion_model", "none"))
    if kind not in ("radtan", "plumb_bob", "equidistant", "none"):
        raise InputError(f"distortion_model {kind!r} is not radtan, equidistant or none")
    values = np.array(entry["intrinsics"], dtype=np.float64)
    if values.shape != (4,):
        raise InputError(f"intrinsics {values.tolist()} are not fu fv pu pv of a pinhole")
    coefficients = np.array(entry.get("distortion_coeffs", []), dtype=np.float64)
    model, params = lens(values[:2], values[2:4], coefficients, fisheye=kind == "equidistant")
    width, height = (int(size) for size in entry["resolution"])
    offset = float(entry.get("timeshift_cam_imu", 0.0))
    return Camera(
        name, (width, height), model, params, pose, offset, float(entry.get("line_delay", 0))
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
