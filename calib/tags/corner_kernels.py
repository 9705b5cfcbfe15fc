"""The inner loop of the pattern fit: one pass over the pixels of one printed tag.

A pixel at the undistorted point x sees I = black + contrast * B(q), with q = H^-1 x in units of
cells and B the tag's cells (1 white, 0 black) blurred by a Gaussian. Blurring a grid of cells is
separable, so B comes from the Gaussian's integral at the four edges around q; where the view
slants, the blur's axes correlate and cell corners gain the first terms of the tetrachoric series
(Kendall 1941) of the bivariate integral. The unknowns are a
small homography composed on the pattern's side, black, contrast and the blur's width:

    q' = q - dq,  dq = (e0 x + e1 y + e2 - x (e6 x + e7 y),  e3 x + e4 y + e5 - y (e6 x + e7 y))

with (x, y) = (q - centre) / half, so that the design is well scaled.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.tags.gaussian_tables import gaussian_edge
from freeswing.calib.tags.tag_map import blur_at_centre
from freeswing.cdpr.compiled.kernels import kernel

Array = NDArray[np.float64]
Rays = NDArray[np.float32]

UNKNOWNS = 11
_FLAT = 4.4  # blur widths from an edge at which nothing of it is left, with a margin


class TagImage(NamedTuple):
    """A tag's pixels.

    Attributes:
        image: grey, (h, w).
        rays: undistorted coordinates of every pixel, (h, w, 2).
        ray_step: how a pixel to the right and one down change the ray, (2, 2) columns.
        cells: the tag's cells with a rim of one cell, (n + 2, n + 2).
        box: left, top, right, bottom (exclusive).
        step: table of the Gaussian's integral.
        bell: table of its density.
    """

    image: NDArray[np.uint8]
    rays: Rays
    ray_step: Array
    cells: Array
    box: NDArray[np.int64]
    step: Array
    bell: Array


class Pass(NamedTuple):
    """One pass over the pixels.

    Attributes:
        normal: (11, 11) upper triangle.
        right: (11,).
        histogram: counts of |residual| in 256 bins of one grey level / 4.
        squares: sum of weighted squared residuals.
        weights: their sum.
        pixels: that took part.
        spread: sum of squares about the mean grey.
    """

    normal: Array
    right: Array
    histogram: NDArray[np.int64]
    squares: float
    weights: float
    pixels: float
    spread: float


class Arrays(NamedTuple):
    """Memory of a `Pass`, and for one row (11,): making it anew costs a tenth of a pass."""

    normal: Array
    right: Array
    histogram: NDArray[np.int64]
    row: Array


class _Slopes(NamedTuple):
    """How column (c) and row (r) in the pattern change by a pixel to the right (u), down (v)."""

    cu: float
    cv: float
    ru: float
    rv: float


class _Blurred(NamedTuple):
    """The pattern at a place, its slopes by column, row and (times the blur) by the blur."""

    value: float
    by_c: float
    by_r: float
    by_blur: float


class _Side(NamedTuple):
    """Along columns or rows: distances of the two edges around, integrals and densities there."""

    z0: float
    z1: float
    s0: float
    s1: float
    g0: float
    g1: float


class _Nine(NamedTuple):
    """A cell and those around it: rows before (a), at (b) and after (c), columns likewise."""

    a0: float
    a1: float
    a2: float
    b0: float
    b1: float
    b2: float
    c0: float
    c1: float
    c2: float


@kernel(forceinline=True)
def _nine(cells: Array, m: int, k: int) -> _Nine:
    """Around cell (m, k); the rim goes on for ever."""
    last = cells.shape[0] - 1
    k0, k2 = max(k - 1, 0), min(k + 1, last)
    m0, m2 = max(m - 1, 0), min(m + 1, last)
    return _Nine(
        cells[m0, k0],
        cells[m0, k],
        cells[m0, k2],
        cells[m, k0],
        cells[m, k],
        cells[m, k2],
        cells[m2, k0],
        cells[m2, k],
        cells[m2, k2],
    )


@kernel(forceinline=True)
def _slopes(h: Array, ray_step: Array, c: float, r: float, w: float) -> _Slopes:
    cx, cy = (h[0, 0] - c * h[2, 0]) * w, (h[0, 1] - c * h[2, 1]) * w
    dx, dy = (h[1, 0] - r * h[2, 0]) * w, (h[1, 1] - r * h[2, 1]) * w
    return _Slopes(
        cx * ray_step[0, 0] + cy * ray_step[1, 0],
        cx * ray_step[0, 1] + cy * ray_step[1, 1],
        dx * ray_step[0, 0] + dy * ray_step[1, 0],
        dx * ray_step[0, 1] + dy * ray_step[1, 1],
    )


@kernel(forceinline=True)
def _side(at: float, cell: int, blur: float, step: Array, bell: Array) -> _Side:
    """The edges before and after cell number `cell`, seen from `at`."""
    z0, z1 = (at - (cell - 1)) / blur, (at - cell) / blur
    s0, g0 = gaussian_edge(z0, step, bell)
    s1, g1 = gaussian_edge(z1, step, bell)
    return _Side(z0, z1, s0, s1, g0, g1)


@kernel(forceinline=True)
def _twist(near: _Nine, c: _Side, r: _Side, rho: float) -> float:
    """What the four cell corners add where the blur's axes correlate by `rho`, over `rho`."""
    twist = 0.0
    if c.g0 * r.g0 > 0.0:
        mixed = near.b1 - near.b0 - near.a1 + near.a0
        twist += mixed * c.g0 * r.g0 * (1.0 + 0.5 * rho * c.z0 * r.z0)
    if c.g1 * r.g0 > 0.0:
        mixed = near.b2 - near.b1 - near.a2 + near.a1
        twist += mixed * c.g1 * r.g0 * (1.0 + 0.5 * rho * c.z1 * r.z0)
    if c.g0 * r.g1 > 0.0:
        mixed = near.c1 - near.c0 - near.b1 + near.b0
        twist += mixed * c.g0 * r.g1 * (1.0 + 0.5 * rho * c.z0 * r.z1)
    if c.g1 * r.g1 > 0.0:
        mixed = near.c2 - near.c1 - near.b2 + near.b1
        twist += mixed * c.g1 * r.g1 * (1.0 + 0.5 * rho * c.z1 * r.z1)
    return twist


@kernel(forceinline=True)
def _blurred(near: _Nine, c: _Side, r: _Side, blur_c: float, blur_r: float, rho: float) -> _Blurred:
    """The cells around a place, blurred by a Gaussian with `rho` between its axes."""
    wc0, wc1, wc2 = 1.0 - c.s0, c.s0 - c.s1, c.s1
    wr0, wr1, wr2 = 1.0 - r.s0, r.s0 - r.s1, r.s1
    left = wr0 * near.a0 + wr1 * near.b0 + wr2 * near.c0
    middle = wr0 * near.a1 + wr1 * near.b1 + wr2 * near.c1
    after = wr0 * near.a2 + wr1 * near.b2 + wr2 * near.c2
    upper = wc0 * near.a0 + wc1 * near.a1 + wc2 * near.a2
    centre = wc0 * near.b0 + wc1 * near.b1 + wc2 * near.b2
    lower = wc0 * near.c0 + wc1 * near.c1 + wc2 * near.c2
    value = wc0 * left + wc1 * middle + wc2 * after
    if (c.g0 + c.g1) * (r.g0 + r.g1) > 0.0:  # few places are near a corner
        value += rho * _twist(near, c, r, rho)
    by_c = (c.g0 * (middle - left) + c.g1 * (after - middle)) / blur_c
    by_r = (r.g0 * (centre - upper) + r.g1 * (lower - centre)) / blur_r
    by_blur = -(
        c.z0 * c.g0 * (middle - left)
        + c.z1 * c.g1 * (after - middle)
        + r.z0 * r.g0 * (centre - upper)
        + r.z1 * r.g1 * (lower - centre)
    )
    return _Blurred(value, by_c, by_r, by_blur)


@kernel(forceinline=True)
def _add_levels(normal: Array, right: Array, value: float, residual: float, weight: float) -> None:
    """Adds a pixel that tells of black and contrast alone."""
    normal[8, 8] += weight
    normal[8, 9] += weight * value
    normal[9, 9] += weight * value * value
    right[8] += weight * residual
    right[9] += weight * residual * value


@kernel(forceinline=True)
def _add_row(normal: Array, right: Array, design: Array, residual: float, weight: float) -> None:
    """Adds a pixel that tells of all unknowns."""
    for i in range(UNKNOWNS):
        wi = weight * design[i]
        right[i] += wi * residual
        for j in range(i, UNKNOWNS):
            normal[i, j] += wi * design[j]


@kernel(forceinline=True)
def _fill_design(
    design: Array, seen: _Blurred, x: float, y: float, contrast: float, blur: float
) -> None:
    """Slopes of a pixel's grey by the unknowns, at (x, y) from the tag's middle in half sides."""
    gc, gr = -contrast * seen.by_c, -contrast * seen.by_r
    lean = -(gc * x + gr * y)
    design[0], design[1], design[2] = gc * x, gc * y, gc
    design[3], design[4], design[5] = gr * x, gr * y, gr
    design[6], design[7] = lean * x, lean * y
    design[8], design[9] = 1.0, seen.value
    design[10] = contrast * seen.by_blur / blur


@kernel(forceinline=True)
def _is_flat(c: float, r: float, k: int, m: int, n: int, flat_c: float, flat_r: float) -> bool:
    """Whether a place lies so deep in cell (m, k) that nothing of its edges is left."""
    from_c, from_r = c - (k - 1), r - (m - 1)
    inside_c = from_c > flat_c and from_c < 1.0 - flat_c
    inside_r = from_r > flat_r and from_r < 1.0 - flat_r
    return inside_c and inside_r and k > 0 and m > 0 and k <= n and m <= n


@kernel
def new_arrays() -> Arrays:
    """Memory of one fit."""
    normal, right = np.zeros((UNKNOWNS, UNKNOWNS)), np.zeros(UNKNOWNS)
    return Arrays(normal, right, np.zeros(256, dtype=np.int64), np.zeros(UNKNOWNS))


@kernel
def accumulate(
    tag: TagImage, h: Array, state: Array, stride: int, scale: float, arrays: Arrays
) -> Pass:
    """One pass over the pixels: the normal equations at the present state.

    Args:
        tag: the pixels.
        h: (x, y, 1) to cell coordinates, the tag's black border at 0 ... n.
        state: black, contrast, blur in px.
        stride: use one pixel in so many, spread over a lattice.
        scale: noise level beyond four times which a pixel loses weight.
        arrays: what the pass is written to and given back in.
    """
    normal, right, histogram, design = arrays
    normal[:], right[:], histogram[:] = 0.0, 0.0, 0
    image, rays, ray_step, cells, box, step, bell = tag
    n = cells.shape[0] - 2
    half, limit = n / 2.0, 4.0 * scale
    black, contrast, blur = state[0], state[1], state[2]
    squares = weights = count = 0.0
    total = total_squares = 0.0
    flat_c, flat_r = blur_at_centre(h, ray_step, half, _FLAT * blur)
    skew = max(1, int(stride * 0.618 + 0.5))
    for v in range(box[1], box[3]):
        for u in range(box[0] + (v * skew) % stride, box[2], stride):
            rx, ry = rays[v, u, 0], rays[v, u, 1]
            w = 1.0 / (h[2, 0] * rx + h[2, 1] * ry + h[2, 2])
            c = (h[0, 0] * rx + h[0, 1] * ry + h[0, 2]) * w
            r = (h[1, 0] * rx + h[1, 1] * ry + h[1, 2]) * w
            if not (c > -1.0 and r > -1.0 and c < n + 1.0 and r < n + 1.0):
                continue
            k, m = math.floor(c) + 1, math.floor(r) + 1
            if _is_flat(c, r, k, m, n, flat_c, flat_r):
                if (u + 2 * v) & 3:  # inside a cell a quarter of the pixels says as much
                    continue
                seen, steep = _Blurred(float(cells[m, k]), 0.0, 0.0, 0.0), False
            else:
                cu, cv, ru, rv = _slopes(h, ray_step, c, r, w)
                blur_c = blur * math.sqrt(cu * cu + cv * cv)
                blur_r = blur * math.sqrt(ru * ru + rv * rv)
                rim_c = max(1.0 - 3.5 * blur_c, 0.2)
                rim_r = max(1.0 - 3.5 * blur_r, 0.2)
                if c < -rim_c or c > n + rim_c or r < -rim_r or r > n + rim_r:
                    continue
                rho = (cu * ru + cv * rv) * blur * blur / (blur_c * blur_r)
                across = _side(c, k, blur_c, step, bell)
                down = _side(r, m, blur_r, step, bell)
                seen = _blurred(_nine(cells, m, k), across, down, blur_c, blur_r, rho)
                steep = not abs(seen.by_c) * blur_c + abs(seen.by_r) * blur_r < 1e-3
            grey = float(image[v, u])
            residual = grey - black - contrast * seen.value
            size = abs(residual)
            weight = 1.0 if size <= limit else (limit / size) ** 2
            histogram[min(int(size * 4.0), 255)] += 1
            squares += weight * residual * residual
            weights += weight
            count += 1.0
            total += grey
            total_squares += grey * grey
            if steep:
                _fill_design(design, seen, (c - half) / half, (r - half) / half, contrast, blur)
                _add_row(normal, right, design, residual, weight)
            else:
                _add_levels(normal, right, seen.value, residual, weight)
    spread = total_squares - total * total / max(count, 1.0)
    return Pass(normal, right, histogram, squares, weights, count, spread)
