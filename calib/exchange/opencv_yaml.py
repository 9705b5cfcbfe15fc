"""OpenCV's FileStorage yaml: `camera_matrix`, `distortion_coefficients`, sizes, by camera.

A file of one camera holds the keys at its top, as OpenCV's own calibration sample writes them; a
rig holds a list `cameras` with, beside them, `name`, `model` and `T_camera_base`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calib.camera import Camera
from calib.camera_models import FISHEYE
from calib.exchange.lens import distortion, lens, matrix, shortest
from cdpr.documents import InputError, read_text, replace_file

_MOST_BYTES = 1 << 24


def read(path: Path) -> tuple[Camera, ...]:
    """The cameras of the file."""
    import cv2

    text = read_text(path, _MOST_BYTES)
    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        listed = storage.getNode("cameras")
        if listed.empty():
            return (_camera(path, storage.root(), path.stem),)
        nodes = [listed.at(index) for index in range(listed.size())]
        return tuple(_camera(path, node, f"cam{i}") for i, node in enumerate(nodes))
    except (cv2.error, SystemError) as error:
        raise InputError(f"{path}: not a file of OpenCV's ({str(error)[:200]})") from error


def _camera(path: Path, node, name: str) -> Camera:
    K = node.getNode("camera_matrix").mat()
    k = node.getNode("distortion_coefficients").mat()
    width = int(node.getNode("image_width").real())
    height = int(node.getNode("image_height").real())
    if K is None or k is None or width < 1 or height < 1:
        raise InputError(
            f"{path}: needs camera_matrix, distortion_coefficients, image_width and image_height"
        )
    fisheye = node.getNode("model").string() in (FISHEYE, "fisheye")
    model, params = lens(K[[0, 1], [0, 1]], K[:2, 2], k, fisheye=fisheye)
    T = node.getNode("T_camera_base").mat()
    given = node.getNode("name").string()
    pose = np.eye(4) if T is None else T
    return Camera(given or name, (width, height), model, params, pose)


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
