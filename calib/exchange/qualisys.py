"""Qualisys QTM calibration (.qca.txt, xml): lens in 1/64 pixel, pose in millimetres.

QTM's `transform` places the camera in the world: position x, y, z, and a rotation whose rows are
the camera's axes x right, y up, z backwards; OpenCV's are turned by half a turn about x. Pixel 0 is
the centre of the first pixel (sensorMax is the last pixel's index).
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import FISHEYE
from freeswing.calib.exchange.matrix_and_distortion import (
    ODD_ENTRY,
    distortion,
    lens,
    refuse_skew,
    shortest,
    turned,
    usable,
)
from freeswing.cdpr.files.documents import InputError, read_text, replace_file
from freeswing.cdpr.rotation import invert, transform

SUBPIXELS = 64.0
_HALF_TURN = np.diag([1.0, -1.0, -1.0])
_MOST_BYTES = 1 << 24
_NEAR_MIDDLE = 0.3
"""Lenses sit within a twentieth of the middle; a picture cut out of the sensor may be off more."""


def read(path: Path, tell: Callable[[str], None]) -> tuple[Camera, ...]:
    """The active cameras, named by serial number."""
    text = read_text(path, _MOST_BYTES)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError(f"{path}: xml with a document type of its own is not read")
    try:
        root = ElementTree.fromstring(text)  # a declared encoding is void: it is text by now
    except ElementTree.ParseError as error:
        raise InputError(f"{path}: not xml: {error}") from error
    cameras = []
    for entry in root.iter("camera"):
        if entry.get("active", "1") == "0":
            continue
        name = entry.get("serial", f"camera{len(cameras) + 1}")
        try:
            cameras.append(_camera(name, entry, tell))
        except ODD_ENTRY as error:
            raise InputError(f"{path}: camera {name}: {error}") from error
    if not cameras:
        raise InputError(f"{path}: holds no active camera")
    return tuple(cameras)


def _camera(name: str, entry: ElementTree.Element, tell: Callable[[str], None]) -> Camera:
    pose, optics = entry.find("transform"), entry.find("intrinsic")
    field = entry.find("fov_video")
    if pose is None or optics is None:
        raise InputError("has no transform or no intrinsic")
    area = field if field is not None else entry.find("fov_marker")
    if area is None:
        raise InputError("has no fov_video")
    corner = np.array([_number(area, "left"), _number(area, "top")])
    size = np.array([_number(area, "right"), _number(area, "bottom")]) - corner + 1.0
    quarters = round(float(entry.get("viewrotation", "0") or 0.0) / 90.0) % 4
    focal = np.array([_number(optics, f"focalLength{axis}") for axis in "UV"]) / SUBPIXELS
    centre = np.array([_number(optics, f"centerPoint{axis}") for axis in "UV"]) / SUBPIXELS
    refuse_skew(_number(optics, "skew") if "skew" in optics.attrib else 0.0, focal[0] * SUBPIXELS)
    if quarters % 2 and size[0] < size[1]:
        size, corner = size[::-1], corner[::-1]  # the picture is turned, the lens is not
    binning = _binning(centre, corner, size)
    radial = [_number(optics, f"radialDistortion{k}") for k in (1, 2, 3)]
    tangential = [_number(optics, f"tangentalDistortion{k}") for k in (1, 2)]
    k = np.array([radial[0], radial[1], tangential[0], tangential[1], radial[2]])
    # the middle of the first of several binned pixels lies (binning - 1) / 2 sensor pixels on
    binned = (centre - 0.5 * (binning - 1)) / binning - corner
    model, params = lens(focal / binning, binned, k, fisheye=False)
    rotation = np.array([[_number(pose, f"r{i}{j}") for j in (1, 2, 3)] for i in (1, 2, 3)])
    place = np.array([_number(pose, axis) for axis in "xyz"]) / 1000.0
    T_base_camera = transform(rotation.T @ _HALF_TURN, place)
    size_px = (int(size[0]), int(size[1]))
    camera = Camera(name, size_px, model, params, invert(T_base_camera))
    if binning > 1:
        tell(f"camera {name}: its picture bins {binning} x {binning} pixels of the sensor")
    if quarters:
        tell(
            f"camera {name}: viewrotation {90 * quarters}: read as a clockwise turn of the picture"
        )
    for _ in range(quarters):
        camera = turned(camera)
    return camera


def _binning(centre: np.ndarray, corner: np.ndarray, size: np.ndarray) -> int:
    """Sensor pixels to a pixel of the picture, each way.

    The lens looks through the middle of the sensor, so its axis meets the picture near the middle.

    Raises:
        InputError: when no binning puts it there.
    """
    for binning in (1, 2, 3, 4):
        share = (centre / binning - corner) / size
        if (np.abs(share - 0.5) < _NEAR_MIDDLE).all():
            return binning
    raise InputError(
        f"its principal point {centre.round(1).tolist()} lies outside the middle of the picture of "
        f"{size.round().tolist()} pixels, binned or not: centerPoint and fov_video contradict"
    )


def _number(entry: ElementTree.Element, key: str) -> float:
    return float(usable(entry.get(key, "nan"), key))


def write(path: Path, cameras: Sequence[Camera]) -> None:
    """A file that QTM's readers take; lenses up to k1 k2 p1 p2 k3.

    Raises:
        InputError: for a fisheye or more coefficients.
    """
    root = ElementTree.Element("calibration", {"source": "freeswing", "type": "regular"})
    parent = ElementTree.SubElement(root, "cameras")
    for camera in cameras:
        if camera.model == FISHEYE:
            raise InputError(f"camera {camera.name}: QTM's file holds no fisheye lens")
        entry = ElementTree.SubElement(parent, "camera", {"active": "1", "serial": camera.name})
        right, bottom = camera.size_px[0] - 1, camera.size_px[1] - 1
        area = {"left": "0", "top": "0", "right": str(right), "bottom": str(bottom)}
        ElementTree.SubElement(entry, "fov_video", area)
        T = invert(camera.T_camera_base)
        rotation = (T[:3, :3] @ _HALF_TURN).T
        pose = {f"r{i + 1}{j + 1}": repr(float(rotation[i, j])) for i in range(3) for j in range(3)}
        pose |= {axis: repr(float(1000.0 * T[i, 3])) for i, axis in enumerate("xyz")}
        ElementTree.SubElement(entry, "transform", pose)
        k = shortest(distortion(camera), (5,))
        values = {
            "focalLengthU": camera.focal_px[0] * SUBPIXELS,
            "focalLengthV": camera.focal_px[1] * SUBPIXELS,
            "centerPointU": camera.centre_px[0] * SUBPIXELS,
            "centerPointV": camera.centre_px[1] * SUBPIXELS,
            "radialDistortion1": k[0],
            "radialDistortion2": k[1],
            "radialDistortion3": k[4],
            "tangentalDistortion1": k[2],
            "tangentalDistortion2": k[3],
            "sensorMinU": 0.0,
            "sensorMinV": 0.0,
            "sensorMaxU": right * SUBPIXELS,
            "sensorMaxV": bottom * SUBPIXELS,
            "skew": 0.0,
        }
        texts = {key: repr(float(value)) for key, value in values.items()}
        ElementTree.SubElement(entry, "intrinsic", texts)
    ElementTree.indent(root)
    replace_file(path, ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))
