"""OpenCV's FileStorage, yaml or xml: `camera_matrix`, `distortion_coefficients`, sizes, by camera.

A file of one camera holds the keys at its top, as OpenCV's own calibration sample writes them; a
rig holds a list `cameras` with, beside them, `name`, `model` and `T_camera_base`.
"""

from __future__ import annotations

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
from freeswing.calib.exchange.plain_xml import load_opencv_xml
from freeswing.calib.exchange.plain_yaml import load_yaml
from freeswing.cdpr.files.documents import InputError, replace_file
from freeswing.cdpr.rotation import transform

# as OpenCV's samples of different years, and programs after them, write the keys
_MATRICES = ("camera_matrix", "Camera_Matrix", "cameraMatrix", "K")
_DISTORTIONS = ("distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "D")
_WIDTHS = ("image_width", "image_Width")
_HEIGHTS = ("image_height", "image_Height")
_STEREO = (
    ("M1", "cameraMatrix1", "K1", "D1", "distCoeffs1"),
    ("M2", "cameraMatrix2", "K2", "D2", "distCoeffs2"),
)


def read(path: Path, tell: Callable[[str], None]) -> tuple[Camera, ...]:
    """The cameras of the file.

    OpenCV's own reader ends the process on some damaged files, so this one does not use it.
    """
    document = _document(path)
    if _first(document, _STEREO[0][:3]) is not None:
        pair = in_metres(path, _stereo(path, document), tell)
        apart = float(np.linalg.norm(pair[1].position_base_m))
        tell(f"{path}: states no unit: its cameras are taken to stand {apart:.4g} m apart")
        return pair
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
    placeless = [c.name for c, e in zip(cameras, listed, strict=True) if "T_camera_base" not in e]
    if len(cameras) > 1 and placeless:
        tell(f"{path}: {', '.join(placeless)}: no pose (T_camera_base), at the origin")
    return in_metres(path, tuple(cameras), tell)


def _document(path: Path) -> dict[str, Any]:
    """Of yaml or xml."""
    with path.open("rb") as file:
        is_xml = file.read(200).lstrip().startswith(b"<")
    return load_opencv_xml(path) if is_xml else load_yaml(path)


def _stereo(path: Path, document: dict[str, Any]) -> tuple[Camera, ...]:
    """Two cameras of stereo_calib, whose R and T may stand in extrinsics beside intrinsics."""
    beside = path.with_name(path.name.replace("intrinsics", "extrinsics"))
    if _first(document, ("R",)) is None and beside != path and beside.is_file():
        document = {**_document(beside), **document}
    try:
        width, height = _first(document, _WIDTHS), _first(document, _HEIGHTS)
        if width is None or height is None:
            raise InputError("states no image size: add image_width and image_height to it")
        turn, shift = _first(document, ("R",)), _first(document, ("T",))
        if turn is None or shift is None:
            raise InputError("holds no R and T of the second camera: they stand in extrinsics.yml")
        poses = np.eye(4), transform(_matrix(turn).reshape(3, 3), _matrix(shift).reshape(3))
        cameras = []
        for name, keys, pose in zip(("left", "right"), _STEREO, poses, strict=True):
            focal, centre = of_matrix(_matrix(_first(document, keys[:3])))
            k = _matrix(_first(document, keys[3:]))
            model, params = lens(focal, centre, k, fisheye=_is_fisheye(document))
            cameras.append(Camera(name, (int(width), int(height)), model, params, pose))
    except ODD_ENTRY as error:
        raise InputError(f"{path}: not a pair of OpenCV's stereo_calib ({error})") from error
    return tuple(cameras)


def _camera(entry: dict[str, Any], name: str) -> Camera:
    focal, centre = of_matrix(_matrix(_named(entry, _MATRICES)))
    k = _matrix(_named(entry, _DISTORTIONS))
    size = (int(_named(entry, _WIDTHS)), int(_named(entry, _HEIGHTS)))
    model, params = lens(focal, centre, k, fisheye=_is_fisheye(entry))
    pose = _matrix(entry["T_camera_base"]) if "T_camera_base" in entry else np.eye(4)
    return Camera(str(entry.get("name", name)), size, model, params, pose)


def _is_fisheye(entry: dict[str, Any]) -> bool:
    """By the key of OpenCV's own calibration sample, by ours, or by what others write."""
    if str(entry.get("fisheye_model", "0")).strip().lower() not in ("0", "false", ""):
        return True
    told = {
        str(entry.get(key, "")).lower() for key in ("model", "distortion_model", "camera_model")
    }
    return bool(told & {FISHEYE.lower(), "fisheye", "equidistant", "kannala_brandt"})


def _first(entry: dict[str, Any], keys: tuple[str, ...]) -> Any:
    """The first of the keys that is there, else None."""
    return next((entry[key] for key in keys if key in entry), None)


def _named(entry: dict[str, Any], keys: tuple[str, ...]) -> Any:
    value = _first(entry, keys)
    if value is None:
        raise InputError(f"{keys[0]} is missing")
    return value


def _matrix(node: Any) -> np.ndarray:
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
