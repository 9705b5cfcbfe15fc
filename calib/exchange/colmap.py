"""COLMAP's text model: a folder with cameras.txt, images.txt and an empty points3D.txt.

COLMAP puts the corner of the top-left pixel at (0, 0), its centre at (0.5, 0.5): principal points
are shifted by half a pixel both ways. The base frame is COLMAP's world.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import PARAMETER_NAMES
from freeswing.calib.exchange.matrix_and_distortion import ODD_ENTRY, usable
from freeswing.calib.exchange.names import distinct_names
from freeswing.cdpr.files.documents import InputError, read_text, replace_file
from freeswing.cdpr.rotation import matrix_from_quaternion, quaternion_from_matrix, transform

HALF_PIXEL = 0.5
_MOST_BYTES = 1 << 28
_LEAST_QUATERNION = 1e-6
_PLAIN_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def read(path: Path, tell: Callable[[str], None]) -> tuple[Camera, ...]:
    """One camera an image, named as the image without suffix; `path` is the folder.

    Where images of several folders have one name, the folders name the cameras.
    """
    folder = path if path.is_dir() else path.parent
    return read_text_model(folder, folder, tell)


def read_text_model(folder: Path, named: Path, tell: Callable[[str], None]) -> tuple[Camera, ...]:
    """The cameras of a text model that the user knows under another name.

    Raises:
        InputError: when it is none.
    """
    try:
        return _cameras(folder, tell)
    except ODD_ENTRY as error:
        raise InputError(f"{named}: not COLMAP's text model: {str(error)[:200]}") from error


def _cameras(folder: Path, tell: Callable[[str], None]) -> tuple[Camera, ...]:
    lenses: dict[str, tuple[str, tuple[int, int], np.ndarray]] = {}
    for row in _rows(folder / "cameras.txt"):
        number, model, width, height, *params = row
        if model not in PARAMETER_NAMES:
            raise InputError(f"{folder / 'cameras.txt'}: model {model} is not supported")
        values = np.array(params, dtype=np.float64)
        values[_centre(model)] -= HALF_PIXEL
        lenses[number] = (model, (int(width), int(height)), values)
    cameras = []
    stated = [row for row in _images(folder / "images.txt") if len(row) > 9]
    images = [row for row in stated if row[8] in lenses]
    for row in stated:
        if row[8] not in lenses:
            tell(f"image {' '.join(row[9:])}: its camera {row[8]} is not in cameras.txt: left out")
    for number in sorted(set(lenses) - {row[8] for row in images}):
        tell(f"camera {number} of cameras.txt took no image that has a pose: left out")
    stems = [Path(" ".join(row[9:])).with_suffix("") for row in images]
    names = distinct_names([stem.parts for stem in stems], [row[0] for row in images])
    for row, name in zip(images, names, strict=True):
        q, t = usable(row[1:5], "quaternion"), usable(row[5:8], "translation")
        if not np.linalg.norm(q) > _LEAST_QUATERNION:
            raise InputError(f"quaternion {row[1:5]} has no length")
        model, size, params = lenses[row[8]]
        pose = transform(matrix_from_quaternion(q), t)
        cameras.append(Camera(name, size, model, params, pose))
    if not cameras:
        raise InputError(f"{folder / 'images.txt'}: holds no image with a camera of cameras.txt")
    return tuple(cameras)


def _rows(path: Path) -> list[list[str]]:
    lines = read_text(path, _MOST_BYTES).splitlines()
    return [line.split() for line in lines if line.strip() and not line.startswith("#")]


def _images(path: Path) -> list[list[str]]:
    """The lines that state images: each is followed by one of image points, which may be empty."""
    lines = [line.split() for line in read_text(path, _MOST_BYTES).splitlines()]
    lines = [row for row in lines if not (row and row[0].startswith("#"))]
    found: list[list[str]] = []
    points_next = False
    for row in lines:
        if points_next and _is_points(row):
            points_next = False
        elif row:
            found.append(row)
            points_next = True
    return found


def _is_points(row: list[str]) -> bool:
    """Whether a line is one of image points: x y id, x y id, ..."""
    return len(row) % 3 == 0 and all(_PLAIN_NUMBER.fullmatch(word) for word in row)


def _centre(model: str) -> list[int]:
    names = PARAMETER_NAMES[model]
    return [names.index("cx"), names.index("cy")]


def write(path: Path, cameras: Sequence[Camera]) -> None:
    """The folder's three files; each camera is one image `<camera>.png`."""
    lenses, images = [], []
    for number, camera in enumerate(cameras, start=1):
        params = np.array(camera.params)
        params[_centre(camera.model)] += HALF_PIXEL
        width, height = camera.size_px
        lenses.append(f"{number} {camera.model} {width} {height} {_numbers(params)}")
        q = quaternion_from_matrix(camera.T_camera_base[:3, :3])
        t = camera.T_camera_base[:3, 3]
        images += [f"{number} {_numbers(q)} {_numbers(t)} {number} {camera.name}.png", ""]
    header = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
    replace_file(path / "cameras.txt", (header + "\n".join(lenses) + "\n").encode())
    header = "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, ID)\n"
    replace_file(path / "images.txt", (header + "\n".join(images) + "\n").encode())
    replace_file(path / "points3D.txt", b"# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]\n")


def _numbers(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)
