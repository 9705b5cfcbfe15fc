"""Lens models by COLMAP's names: projection with analytic Jacobians, and its inverse.

All perspective models are special cases of the rational model (OpenCV `calib3d`, "Camera
Calibration and 3D Reconstruction"): with x = X/Z, y = Y/Z, r2 = x^2 + y^2,

    g  = (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3)
    x" = x g + 2 p1 x y + p2 (r2 + 2 x^2),   y" = y g + p1 (r2 + 2 y^2) + 2 p2 x y
    u  = fx x" + cx,                         v  = fy y" + cy

so each is stated by the columns that its parameters fill in the full list
`fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6`. OPENCV_FISHEYE is Kannala and Brandt's
theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.lens_kernels import (
    CONVERGED,
    NEWTON_STEPS,
    SMALL_SINE,
    SOLVED,
    lens_jacobians,
    lens_pixels,
    perspective_rays,
)

Array = NDArray[np.float64]

FULL_NAMES = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
PARAMETER_NAMES: dict[str, tuple[str, ...]] = {
    "SIMPLE_PINHOLE": ("f", "cx", "cy"),
    "PINHOLE": ("fx", "fy", "cx", "cy"),
    "SIMPLE_RADIAL": ("f", "cx", "cy", "k1"),
    "RADIAL": ("f", "cx", "cy", "k1", "k2"),
    "OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"),
    "FULL_OPENCV": FULL_NAMES,
    "OPENCV_FISHEYE": ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"),
}
FISHEYE = "OPENCV_FISHEYE"


@lru_cache(maxsize=64)
def _selection(model: str) -> Array:
    """Maps a model's parameters to the full list: full = selection @ params, (12, k)."""
    selection = np.zeros((len(FULL_NAMES), len(PARAMETER_NAMES[model])))
    for column, name in enumerate(PARAMETER_NAMES[model]):
        for row, full_name in enumerate(FULL_NAMES):
            selection[row, column] = full_name == name or (
                name == "f" and full_name in ("fx", "fy")
            )
    return np.eye(len(FULL_NAMES), 8) if model == FISHEYE else selection


def parameter_columns(model: str) -> NDArray[np.int64]:
    """Which of a model's parameters each entry of the full list is, -1 for none, (12,)."""
    selection = _selection(model)
    return np.where(selection.any(axis=1), selection.argmax(axis=1), -1)


def focal_and_centre(model: str, params: Array) -> tuple[Array, Array]:
    """Focal lengths (2,) and principal point (2,) in pixels."""
    if PARAMETER_NAMES[model][0] == "f":
        return np.array([params[0], params[0]]), np.array(params[1:3])
    return np.array(params[0:2]), np.array(params[2:4])


def full_parameters(model: str, params: Array) -> Array:
    """The parameters as the full list `FULL_NAMES`, the fisheye's in its first eight, (12,).

    Source:
        Brown 1971, Close-Range Camera Calibration: the distortion that the full list holds.
    """
    return _selection(model) @ params


def project(model: str, points: Array, params: Array) -> Array:
    """Pixels (..., 2) of camera-frame points (..., 3); NaN where the model cannot see them.

    Source:
        Brown 1971, Close-range camera calibration, as OpenCV's calib3d writes it; the fisheye
        Kannala, Brandt 2006, A generic camera model, eq. (6).
    """
    flat = _flat(points)
    pixels = lens_pixels(model == FISHEYE, full_parameters(model, params), flat)
    return pixels.reshape(*points.shape[:-1], 2)


def project_jacobian(model: str, points: Array, params: Array) -> tuple[Array, Array, Array]:
    """Pixels (..., 2) with their derivatives by the point (..., 2, 3) and params (..., 2, k).

    Source:
        Brown 1971, Close-range camera calibration, as OpenCV's calib3d writes it; the fisheye
        Kannala, Brandt 2006, A generic camera model, eq. (6).
    """
    full = full_parameters(model, params)
    pixels, d_point, d_full = lens_jacobians(model == FISHEYE, full, _flat(points))
    d_params = d_full if model == "FULL_OPENCV" else d_full @ _selection(model)
    batch = points.shape[:-1]
    return (
        pixels.reshape(*batch, 2),
        d_point.reshape(*batch, 2, 3),
        d_params.reshape(*batch, 2, len(params)),
    )


def _flat(points: Array) -> Array:
    return np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)


def radius_limit(model: str, params: Array) -> float:
    """Largest x/z radius (angle in rad for the fisheye) up to which the lens stays one to one.

    The radial curve must rise; past its first maximum two rays share a pixel. Infinite when it
    rises for ever (the fisheye: pi, the whole sphere).
    """
    return _radius_limit(model, tuple(float(value) for value in params))


@lru_cache(maxsize=256)
def _radius_limit(model: str, numbers: tuple[float, ...]) -> float:
    params = np.array(numbers)
    if model == FISHEYE:
        slope = np.array([9 * params[7], 7 * params[6], 5 * params[5], 3 * params[4], 1.0])
        return min(float(np.pi), _first_positive_root(slope))
    _, _, _, _, k1, k2, _, _, k3, k4, k5, k6 = full_parameters(model, params)
    above = np.array([k3, k2, k1, 1.0])
    below = np.array([k6, k5, k4, 1.0])
    s = np.array([2.0, 0.0])  # d(r g)/dr = g + 2 s dg/ds with s = r^2
    slope = np.polyadd(
        np.polymul(above, below),
        np.polymul(
            s,
            np.polysub(np.polymul(np.polyder(above), below), np.polymul(above, np.polyder(below))),
        ),
    )
    return min(_first_positive_root(np.asarray(slope, float)), _first_positive_root(below))


def _first_positive_root(polynomial_in_square: Array) -> float:
    """Square root of the smallest positive real root; infinite when there is none."""
    roots = np.roots(np.trim_zeros(polynomial_in_square, "f"))
    real = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0.0)]
    return float(np.sqrt(real.min())) if real.size else float("inf")


def normalise(model: str, pixels: Array, params: Array) -> Array:
    """Undistorted (x/z, y/z) of pixels, (..., 2); NaN where no ray of the lens gives the pixel.

    Source:
        Brown 1971, Close-Range Camera Calibration; the fisheye: Kannala, Brandt 2006, A
        Generic Camera Model, eq. (6); both inverted by Newton's method.
    """
    focal, centre = focal_and_centre(model, params)
    distorted = (np.asarray(pixels, dtype=np.float64) - centre) / focal
    if model == FISHEYE:
        return _fisheye_undistort(distorted, params)
    if model in ("PINHOLE", "SIMPLE_PINHOLE"):
        return distorted
    return _perspective_undistort(distorted, model, params)


def _perspective_undistort(distorted: Array, model: str, params: Array) -> Array:
    unit = full_parameters(model, params)
    unit[:4] = (1.0, 1.0, 0.0, 0.0)
    flat = np.ascontiguousarray(distorted).reshape(-1, 2)
    return perspective_rays(flat, unit, radius_limit(model, params)).reshape(distorted.shape)


def _fisheye_undistort(distorted: Array, params: Array) -> Array:
    """Newton on theta alone; NaN from 90 degrees on, where x/z has no meaning."""
    k = params[4:8]
    limit = radius_limit(FISHEYE, params)
    theta_d = np.linalg.norm(distorted, axis=-1)
    theta = np.minimum(theta_d, limit)
    for _ in range(NEWTON_STEPS):
        t2 = theta * theta
        value = theta * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))))
        slope = 1.0 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])))
        step = (theta_d - value) / np.where(np.abs(slope) < 1e-6, 1e-6, slope)
        theta = np.clip(theta + step, 0.0, limit)
        if not np.any(np.abs(step) > CONVERGED):
            break
    t2 = theta * theta
    value = theta * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))))
    solved = (np.abs(value - theta_d) < SOLVED) & (theta < min(limit, np.pi / 2))
    on_axis = theta_d < SMALL_SINE
    scale = np.where(on_axis, 1.0, np.tan(theta) / np.where(on_axis, 1.0, theta_d))
    return np.where(solved[..., None], distorted * scale[..., None], np.nan)
