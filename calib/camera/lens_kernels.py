"""Lens formulas of `calib.camera.lens_models` for one point at a time, with derivatives.

Parameters come as the full list `FULL_NAMES` of that module (the fisheye's eight in its first
eight places); derivatives by them go out in the same order.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel

Array = NDArray[np.float64]

SMALL_SINE = 1e-9
NEWTON_STEPS = 30
CONVERGED = 1e-12
_LEAST_DETERMINANT = 1e-6
SOLVED = 1e-9
# For `slopes`: each of a plain True and False is a type, for which all would be compiled again.
WITH_SLOPES, WITHOUT_SLOPES = np.bool_(True), np.bool_(False)
_NEIGHBOUR = 0.01  # step to a neighbouring pixel of any lens here: rays farther apart start anew


@kernel
def perspective(
    full: Array, point: Array, slopes: bool, pixel: Array, d_point: Array, d_full: Array
) -> None:
    """Rational model: fills pixel (2,), NaN behind the camera; d_point (2, 3), d_full (2, 12)."""
    inverse_z = 1.0 / point[2] if point[2] > 0.0 else math.nan
    x, y = point[0] * inverse_z, point[1] * inverse_z
    fx, fy, p1, p2 = full[0], full[1], full[6], full[7]
    k1, k2, k3, k4, k5, k6 = full[4], full[5], full[8], full[9], full[10], full[11]
    r2 = x * x + y * y
    above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    below = 1.0 / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    gain = above * below
    xd = x * gain + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
    yd = y * gain + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
    pixel[0], pixel[1] = fx * xd + full[2], fy * yd + full[3]
    if not slopes:
        return
    slope = k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2) - gain * (k4 + r2 * (2.0 * k5 + 3.0 * k6 * r2))
    slope *= below  # d gain / d r2
    cross = 2.0 * x * y * slope + 2.0 * (p1 * x + p2 * y)
    xx = gain + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
    yy = gain + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
    d_point[0, 0], d_point[0, 1] = fx * xx * inverse_z, fx * cross * inverse_z
    d_point[0, 2] = -fx * (xx * x + cross * y) * inverse_z
    d_point[1, 0], d_point[1, 1] = fy * cross * inverse_z, fy * yy * inverse_z
    d_point[1, 2] = -fy * (cross * x + yy * y) * inverse_z
    d_full[:] = 0.0
    d_full[0, 0], d_full[1, 1] = xd, yd
    d_full[0, 2] = d_full[1, 3] = 1.0
    d_full[0, 6], d_full[1, 6] = 2.0 * fx * x * y, fy * (r2 + 2.0 * y * y)
    d_full[0, 7], d_full[1, 7] = fx * (r2 + 2.0 * x * x), 2.0 * fy * x * y
    power = below
    for k in range(3):
        power *= r2
        numerator = 4 + k if k < 2 else 8
        d_full[0, numerator], d_full[1, numerator] = fx * x * power, fy * y * power
        d_full[0, 9 + k] = -gain * fx * x * power
        d_full[1, 9 + k] = -gain * fy * y * power


@kernel
def fisheye(
    full: Array, point: Array, slopes: bool, pixel: Array, d_point: Array, d_full: Array
) -> None:
    """Kannala and Brandt's model: fills as `perspective` does; NaN at and behind the centre."""
    fx, fy = full[0], full[1]
    x, y, z = point[0], point[1], point[2]
    rho2 = x * x + y * y
    rho = math.sqrt(rho2)
    theta = math.atan2(rho, z)
    t2 = theta * theta
    near_axis = rho < SMALL_SINE * abs(z)
    if near_axis:
        scale = 1.0 / z if z > 0.0 else math.nan
        safe2 = 1.0
        power = 0.0
    else:
        bent = theta * (1.0 + t2 * (full[4] + t2 * (full[5] + t2 * (full[6] + t2 * full[7]))))
        scale = bent / rho if rho > 0.0 else math.nan
        safe2 = rho2
        power = theta / rho if rho > 0.0 else math.nan
    pixel[0], pixel[1] = fx * scale * x + full[2], fy * scale * y + full[3]
    if not slopes:
        return
    slope = 1.0 + t2 * (
        3.0 * full[4] + t2 * (5.0 * full[5] + t2 * (7.0 * full[6] + t2 * 9.0 * full[7]))
    )
    d2 = rho2 + z * z
    # d theta / d(x, y, z) = (x z / rho, y z / rho, -rho) / d2
    inner = 0.0 if near_axis else (slope * z / d2 - scale) / safe2
    d_point[0, 0], d_point[0, 1] = fx * (scale + inner * x * x), fx * inner * x * y
    d_point[0, 2] = -fx * slope * x / d2
    d_point[1, 0], d_point[1, 1] = fy * inner * x * y, fy * (scale + inner * y * y)
    d_point[1, 2] = -fy * slope * y / d2
    d_full[:] = 0.0
    d_full[0, 0], d_full[1, 1] = scale * x, scale * y
    d_full[0, 2] = d_full[1, 3] = 1.0
    for column in range(4, 8):
        power *= t2
        d_full[0, column], d_full[1, column] = fx * power * x, fy * power * y


@kernel
def lens_point(
    is_fisheye: bool,
    full: Array,
    point: Array,
    slopes: bool,
    pixel: Array,
    d_point: Array,
    d_full: Array,
) -> None:
    """Either model; derivatives only with `slopes`."""
    if is_fisheye:
        fisheye(full, point, slopes, pixel, d_point, d_full)
    else:
        perspective(full, point, slopes, pixel, d_point, d_full)


@kernel
def lens_pixels(is_fisheye: bool, full: Array, points: Array) -> Array:
    """Pixels (n, 2) of camera-frame points (n, 3).

    Source:
        Brown 1971, Close-range camera calibration, as OpenCV's calib3d writes it; the fisheye
        Kannala, Brandt 2006, A generic camera model, eq. (6).
    """
    pixels = np.empty((len(points), 2))
    d_point, d_full = np.empty((2, 3)), np.empty((2, 12))
    for k in range(len(points)):
        lens_point(is_fisheye, full, points[k], WITHOUT_SLOPES, pixels[k], d_point, d_full)
    return pixels


@kernel
def lens_jacobians(is_fisheye: bool, full: Array, points: Array) -> tuple[Array, Array, Array]:
    """Pixels (n, 2), and their derivatives by point (n, 2, 3) and full parameters (n, 2, 12)."""
    count = len(points)
    pixels, d_point = np.empty((count, 2)), np.empty((count, 2, 3))
    d_full = np.empty((count, 2, 12))
    for k in range(count):
        lens_point(is_fisheye, full, points[k], WITH_SLOPES, pixels[k], d_point[k], d_full[k])
    return pixels, d_point, d_full


class _Bent(NamedTuple):
    """A ray (x, y, 1) through the unit lens: its image, and that by x and y (v by x is u by y)."""

    u: float
    v: float
    ux: float
    uy: float
    vy: float


@kernel(forceinline=True)
def _bent(full: Array, x: float, y: float) -> _Bent:
    """As `perspective` at depth 1 with its slopes by x and y, focal lengths of one."""
    p1, p2 = full[6], full[7]
    k1, k2, k3, k4, k5, k6 = full[4], full[5], full[8], full[9], full[10], full[11]
    r2 = x * x + y * y
    below = 1.0 / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    gain = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) * below
    slope = k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2) - gain * (k4 + r2 * (2.0 * k5 + 3.0 * k6 * r2))
    slope *= below
    cross = 2.0 * x * y * slope + 2.0 * (p1 * x + p2 * y)
    return _Bent(
        x * gain + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * gain + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        gain + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
        cross,
        gain + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
    )


@kernel(forceinline=True)
def _step(bent: _Bent, ex: float, ey: float) -> tuple[float, float]:
    """Newton's step of a ray whose image is (ex, ey) away."""
    determinant = bent.ux * bent.vy - bent.uy * bent.uy
    if abs(determinant) < _LEAST_DETERMINANT:
        determinant = _LEAST_DETERMINANT
    sx, sy = bent.vy * ex - bent.uy * ey, bent.ux * ey - bent.uy * ex
    return sx / determinant, sy / determinant


@kernel
def _unbent(
    full: Array, xd: float, yd: float, x: float, y: float, limit: float
) -> tuple[bool, float, float]:
    """Whether Newton's steps from a start end at a ray with this image, and the ray."""
    for _ in range(NEWTON_STEPS):
        bent = _bent(full, x, y)
        sx, sy = _step(bent, xd - bent.u, yd - bent.v)
        x, y = x + sx, y + sy
        length = math.sqrt(x * x + y * y)
        if length > limit:
            x, y = x * limit / length, y * limit / length
        if abs(sx) <= CONVERGED and abs(sy) <= CONVERGED:
            break
    bent = _bent(full, x, y)
    solved = math.hypot(xd - bent.u, yd - bent.v) < SOLVED
    return solved and math.hypot(x, y) < limit, x, y


@kernel
def perspective_rays(distorted: Array, full: Array, limit: float) -> Array:
    """Undistorted x/z, y/z (n, 2) of distorted ones (n, 2); NaN where no ray of the lens is.

    Newton on the two-dimensional distortion, kept inside the radius `limit` up to which the lens
    is one to one; from the ray before, carried on by its slopes, as pixels of a row are
    neighbours, else from the distorted place. `full` has focal lengths of one and no principal
    point.

    Source:
        Heikkila, Silven 1997, A four-step camera calibration procedure, section 4: the distortion
        has no inverse in closed form.
    """
    rays = np.empty_like(distorted)
    found, x, y = False, 0.0, 0.0
    for k in range(len(distorted)):
        xd, yd = distorted[k, 0], distorted[k, 1]
        if found:
            bent = _bent(full, x, y)
            sx, sy = _step(bent, xd - bent.u, yd - bent.v)
            near = math.hypot(sx, sy) < _NEIGHBOUR
            found = False
            if near and math.hypot(x + sx, y + sy) < limit:
                found, x, y = _unbent(full, xd, yd, x + sx, y + sy, limit)
        if not found:
            shorter = min(1.0, 0.9 * limit / max(math.hypot(xd, yd), 1e-12))
            found, x, y = _unbent(full, xd, yd, shorter * xd, shorter * yd, limit)
        if found:
            rays[k, 0], rays[k, 1] = x, y
        else:
            rays[k] = math.nan
    return rays
