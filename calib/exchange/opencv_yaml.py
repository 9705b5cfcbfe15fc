"""OpenCV's FileStorage yaml: `camera_matrix`, `distortion_coefficients`, sizes, by camera.

A file of one camera holds the keys at its top, as OpenCV's own calibration sample writes them; a
rig holds a list `cameras` with, beside them, `name`, `model` and `T_camera_base`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import FISHEYE
from freeswing.calib.exchange.lens import ODD_ENTRY, distortion, lens, matrix, shortest, usable
from freeswing.calib.exchange.plain_yaml import load_yaml
from freeswing.cdpr.files.documents import InputError, replace_file


def read(path: Path) -> tuple[Camera, ...]:
    """The cameras of the file.

    OpenCV's own reader ends the process on some damaged files, so this one does not use it.
    """
    document = load_yaml(path)
    listed = document.get("cameras", [document])
    if not isinstance(listed, list) or not listed:
        raise InputError(f"{path}: cameras is not a list")
    cameras = []
    for index, entry in enumerate(listed):
        name = path.stem if "cameras" not in document else f"cam{index}"
        try:
            cameras.append(_camera(entry, name))
        except ODD_ENTRY as error:
            raise InputError(
                f"{path}: {name}: not a camera of OpenCV's, with camera_matrix, "
                f"distortion_coefficients, image_width and image_height ({error})"
            ) from error
    return tuple(cameras)


def _camera(entry: dict[str, Any], name: str) -> Camera:
    K = _matrix(entry["camera_matrix"]).reshape(3, 3)
    k = _matrix(entry["distortion_coefficients"])
    size = (int(entry["image_width"]), int(entry["image_height"]))
    fisheye = entry.get("model") in (FISHEYE, "fisheye")
    model, params = lens(K[[0, 1], [0, 1]], K[:2, 2], k, fisheye=fisheye)
    pose = _matrix(entry["T_camera_base"]) if "T_camera_base" in entry else np.eye(4)
    return Camera(str(entry.get("name", name)), size, model, params, pose)


def _matrix(node: dict[str, Any]) -> np.ndarray:
    rows, columns = int(node["rows"]), int(node["cols"])
    return usable(node["data"], "a matrix").reshape(rows, columns)


def write(path: Path, cameras: Sequence[Camera]) -> None:
    """All cameras in one file."""
    import cv2

    storage = cv2.FileStorage(".yml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    storage.startWriteStruct("cameras", cv2.FileNode_SEQ)
    for camera in cameras:
        is_fisheye = camera.model == FISHEYE
        k = distortion(camera) if is_fisheye else shortest(distortion(camera), (4, 5, 8))
        storage.startWriteStruct("", cv2.FileNode_MAP)
        storage.write("name", camera.name)
        storage.write("model", camera.model)
        storage.write("image_width", camera.size_px[0])
        storage.write("image_height", camera.size_px[1])
        storage.write("camera_matrix", matrix(camera))
        storage.write("distortion_coefficients", k[None])
        storage.write("T_camera_base", np.array(camera.T_camera_base))
        storage.endWriteStruct()
    storage.endWriteStruct()
    replace_file(path, storage.releaseAndGetString().encode())
