"""Lens parameters as other programs list them: OpenCV's distortion vector and its kin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import FISHEYE, Array, full_parameters
from freeswing.cdpr.files.documents import InputError

# places of FULL_OPENCV's k1 k2 p1 p2 k3 k4 k5 k6 in both lists are the same
_MOST_COEFFICIENTS = 8
# What numbers, lists and texts in each other's place lead to.
ODD_ENTRY = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError)
_MOST = 1e9
_SKEW = 1e-6  # of the focal length: what is stated has some digits, what is rounded has not


def usable(values: object, what: str) -> Array:
    """An array of numbers that one can calculate with.

    Raises:
        InputError: when one of them is not finite or beyond any sense.
    """
    numbers = np.array(values, dtype=np.float64)
    if not (np.abs(numbers) < _MOST).all():
        raise InputError(f"{what} {str(values)[:80]} holds a number that cannot be used")
    return numbers


def matrix(camera: Camera) -> Array:
    """Camera matrix K, (3, 3).

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 6.1.
    """
    fx, fy = camera.focal_px
    cx, cy = camera.centre_px
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def distortion(camera: Camera) -> Array:
    """OpenCV's coefficients: k1 k2 p1 p2 k3 k4 k5 k6, or the fisheye's k1 k2 k3 k4."""
    if camera.model == FISHEYE:
        return np.array(camera.params[4:])
    return full_parameters(camera.model, camera.params)[4:]


def shortest(coefficients: Array, lengths: tuple[int, ...]) -> Array:
    """The coefficients without trailing zeros, at one of the lengths that a format takes.

    Raises:
        InputError: when the lens needs more coefficients than the format has.
    """
    used = int(np.flatnonzero(np.append(1.0, coefficients)).max())
    for length in lengths:
        if length >= used:
            return np.pad(coefficients, (0, max(0, length - len(coefficients))))[:length]
    raise InputError(
        f"the lens uses {used} distortion coefficients, this format holds {lengths[-1]}; calibrate "
        "with --model OPENCV or use another format"
    )


def of_matrix(K: Array) -> tuple[Array, Array]:
    """Focal lengths and principal point of a camera matrix, (2,) each.

    Raises:
        InputError: for one with a skew, or that is none.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 6.1.
    """
    K = usable(K, "the camera matrix").reshape(3, 3)
    if np.abs(K[[1, 2, 2], [0, 0, 1]]).max() > 0.0 or K[2, 2] != 1.0:
        raise InputError(f"camera matrix {K.tolist()} is not one: its last row must be 0 0 1")
    refuse_skew(float(K[0, 1]), float(K[0, 0]))
    return K[[0, 1], [0, 1]], K[:2, 2]


def refuse_skew(skew: float, focal: float) -> None:
    """Passes pixels whose sides are square to each other.

    Raises:
        InputError: where they are not.
    """
    if not abs(skew) <= _SKEW * abs(focal):
        raise InputError(f"a skew of {skew:g}: no lens here has one; calibrate with skew held at 0")


def lens(focal: Array, centre: Array, coefficients: Array, *, fisheye: bool) -> tuple[str, Array]:
    """Model name and params from a camera matrix's entries and OpenCV's coefficients.

    Raises:
        InputError: for coefficients that no model here holds (thin prism, tilted sensor).
    """
    front = np.concatenate([focal, centre])
    k = np.ravel(coefficients).astype(np.float64)
    if not np.isfinite(np.concatenate([front, k])).all() or (np.asarray(focal) <= 0.0).any():
        raise InputError(f"camera matrix or distortion {front.tolist()} {k.tolist()} is not a lens")
    if fisheye:
        return FISHEYE, np.concatenate([front, np.pad(k, (0, 4))[:4]])
    if k[_MOST_COEFFICIENTS:].any():
        raise InputError(f"{len(k)} distortion coefficients; thin prism and tilt are not supported")
    k = np.pad(k, (0, _MOST_COEFFICIENTS))[:_MOST_COEFFICIENTS]
    if k[4:].any():
        return "FULL_OPENCV", np.concatenate([front, k])
    return ("OPENCV", np.concatenate([front, k[:4]])) if k.any() else ("PINHOLE", front)


def turned(camera: Camera) -> Camera:
    """The camera whose picture is this one's turned clockwise by a quarter.

    A pixel (x, y) of a picture of height h comes to (h - 1 - y, x); the camera's axes turn with it.
    """
    width, height = camera.size_px
    fx, fy = camera.focal_px
    cx, cy = camera.centre_px
    k = distortion(camera)
    is_fisheye = camera.model == FISHEYE
    if not is_fisheye:
        k[2:4] = k[3], -k[2]
    model, params = lens(
        np.array([fy, fx]), np.array([height - 1.0 - cy, cx]), k, fisheye=is_fisheye
    )
    quarter = np.array([[0.0, -1.0, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    return replace(
        camera,
        size_px=(height, width),
        model=model,
        params=params,
        T_camera_base=quarter @ camera.T_camera_base,
    )
