"""Between a tag's cells and the camera's rays: its blur in cells, its corners in rays."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel
from freeswing.cdpr.elimination import eliminate

Array = NDArray[np.float64]
_Singular = np.linalg.LinAlgError


@kernel
def inverted(h: Array) -> Array:
    """The inverse of a map (3, 3), by its cofactors.

    Raises LinAlgError where it has none.

    Source:
        Golub, Van Loan 2013, Matrix Computations, sec. 1.1 (problem P1.1.4: cofactors).
    """
    back = np.empty((3, 3))
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            c, d = (j + 1) % 3, (j + 2) % 3
            back[j, i] = h[a, c] * h[b, d] - h[a, d] * h[b, c]
    determinant = h[0, 0] * back[0, 0] + h[0, 1] * back[1, 0] + h[0, 2] * back[2, 0]
    if not (math.isfinite(determinant) and determinant != 0.0):
        raise _Singular("A map between a tag and its image has no inverse.")
    for i in range(3):
        for j in range(3):
            back[i, j] /= determinant
    return back


@kernel(inline="always")
def blur_at_centre(h: Array, ray_step: Array, half: float, blur: float) -> tuple[float, float]:
    """How many cells across and down `blur` pixels are in the middle of the tag, and a margin."""
    back = inverted(h)
    w = 1.0 / (back[2, 0] * half + back[2, 1] * half + back[2, 2])
    x = (back[0, 0] * half + back[0, 1] * half + back[0, 2]) * w
    y = (back[1, 0] * half + back[1, 1] * half + back[1, 2]) * w
    w = 1.0 / (h[2, 0] * x + h[2, 1] * y + h[2, 2])
    across = np.empty(2)
    for row in range(2):
        gx, gy = (h[row, 0] - half * h[2, 0]) * w, (h[row, 1] - half * h[2, 1]) * w
        u = gx * ray_step[0, 0] + gy * ray_step[1, 0]
        v = gx * ray_step[0, 1] + gy * ray_step[1, 1]
        across[row] = blur * math.sqrt(u * u + v * v)
    return across[0], across[1]


@kernel
def map_of_square(rays: Array, side: float) -> Array:
    """Homography from undistorted (x, y, 1) to cells, corners TL TR BR BL at 0 ... side, (3, 3).

    Zeros when three corners lie on a line.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 4.1.
    """
    found = np.zeros((3, 3))
    x0, x1, x2, x3 = rays[0, 0], rays[1, 0], rays[2, 0], rays[3, 0]
    y0, y1, y2, y3 = rays[0, 1], rays[1, 1], rays[2, 1], rays[3, 1]
    sx, sy = x0 - x1 + x2 - x3, y0 - y1 + y2 - y3
    dx1, dy1, dx2, dy2 = x1 - x2, y1 - y2, x3 - x2, y3 - y2
    determinant = dx1 * dy2 - dx2 * dy1
    if not abs(determinant) > 1e-14:
        return found
    g = (sx * dy2 - dx2 * sy) / determinant
    h = (dx1 * sy - sx * dy1) / determinant
    a, b, c = x1 - x0 + g * x1, x3 - x0 + h * x3, x0
    d, e, f = y1 - y0 + g * y1, y3 - y0 + h * y3, y0
    whole = a * (e - f * h) - b * (d - f * g) + c * (d * h - e * g)
    if not abs(whole) > 1e-300:
        return found
    found[0, 0], found[0, 1], found[0, 2] = e - f * h, c * h - b, b * f - c * e
    found[1, 0], found[1, 1], found[1, 2] = f * g - d, a - c * g, c * d - a * f
    found[2, 0], found[2, 1], found[2, 2] = d * h - e * g, b * g - a * h, a * e - b * d
    for i in range(3):
        for j in range(3):
            found[i, j] /= whole
            if i < 2:
                found[i, j] *= side
    return found


@kernel
def compose(pattern_from_ray: Array, e: NDArray[np.floating], half: float) -> Array:
    """The pattern's map after the small homography `e`, which acts on (q - half) / half.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 2.3: maps
        of the plane composed.
    """
    change, moved = np.empty((3, 3)), np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            change[i, j] = (1.0 if i == j else 0.0) + (e[3 * i + j] / half if i + j < 4 else 0.0)
            origin = pattern_from_ray[2, j]
            moved[i, j] = pattern_from_ray[i, j] / half - origin if i < 2 else origin
    eliminate(change, moved)
    for i in range(2):
        for j in range(3):
            moved[i, j] = half * (moved[i, j] + moved[2, j])
    return moved


@kernel
def corners_of_map(
    pattern_from_ray: Array, covariance: Array, n: int
) -> tuple[Array, Array, float]:
    """Corner rays TL TR BR BL (4, 2), their covariance (8, 8) and the shortest side in rays.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 2.3 and
        5.2: covariance through a map.
    """
    back = inverted(pattern_from_ray)
    rays = np.empty((4, 2))
    jacobian = np.zeros((8, 8))
    for k in range(4):
        x = 1.0 if k == 1 or k == 2 else -1.0
        y = 1.0 if k >= 2 else -1.0
        c, r = (x + 1.0) * n / 2.0, (y + 1.0) * n / 2.0
        w = back[2, 0] * c + back[2, 1] * r + back[2, 2]
        rays[k, 0] = (back[0, 0] * c + back[0, 1] * r + back[0, 2]) / w
        rays[k, 1] = (back[1, 0] * c + back[1, 1] * r + back[1, 2]) / w
        for i in range(2):
            by_c = (back[i, 0] - rays[k, i] * back[2, 0]) / w
            by_r = (back[i, 1] - rays[k, i] * back[2, 1]) / w
            line = jacobian[2 * k + i]
            line[0], line[1], line[2] = by_c * x, by_c * y, by_c
            line[3], line[4], line[5] = by_r * x, by_r * y, by_r
            line[6] = -(by_c * x + by_r * y) * x
            line[7] = -(by_c * x + by_r * y) * y
    shortest = 1e300
    for k in range(4):
        dx = rays[k, 0] - rays[(k + 1) % 4, 0]
        dy = rays[k, 1] - rays[(k + 1) % 4, 1]
        shortest = min(shortest, math.sqrt(dx * dx + dy * dy))
    return rays, _carried(jacobian, covariance), shortest


@kernel
def _carried(jacobian: Array, covariance: Array) -> Array:
    """A covariance (8, 8) through a linear map."""
    half, spread = np.zeros((8, 8)), np.zeros((8, 8))
    for i in range(8):
        for k in range(8):
            for j in range(8):
                half[i, j] += jacobian[i, k] * covariance[k, j]
    for i in range(8):
        for j in range(8):
            for k in range(8):
                spread[i, j] += half[i, k] * jacobian[j, k]
    return spread
