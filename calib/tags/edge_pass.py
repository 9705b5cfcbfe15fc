"""One pass over a tag's edge pixels: the normal equations of the pattern fit, by whole vectors.

The model is that of `calib.tags.corner_kernels`, written for pixels each of which sees one cell
corner at the most (`calib.tags.edge_pixels`). Values are computed for a chunk of pixels at a time,
without a branch, so that compilers turn every loop into vector instructions.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.tags.corner_kernels import UNKNOWNS, Pass, TagImage
from freeswing.calib.tags.edge_pixels import (
    CELL_A,
    CELL_B,
    CELL_D,
    CELL_E,
    CHUNK,
    COLUMN,
    COUNTS,
    GREY,
    RAY_X,
    RAY_Y,
    ROW,
)
from freeswing.cdpr.compiled.kernels import kernel

Array = NDArray[np.float64]

_COLUMNS = UNKNOWNS + 1  # the residual stands last
_ROWS = _COLUMNS + 1  # sizes of residuals


class Work(NamedTuple):
    """Memory of a pass: rows of the design, one after the other (13 * CHUNK), sums (12, 12)."""

    design: Array
    sums: Array


@kernel
def new_work() -> Work:
    """Memory of one fit."""
    return Work(np.zeros(_ROWS * CHUNK), np.zeros((_COLUMNS, _COLUMNS)))


@kernel(forceinline=True)
def _edge(z: float) -> tuple[float, float]:
    """The Gaussian's integral (to 8e-8) and density at z, without a branch.

    Source:
        Abramowitz, Stegun 1964, Handbook of Mathematical Functions, eq. (7.1.26).
    """
    far = min(abs(z), 6.0)
    part = far * far * (-0.5 / 32.0)  # exp(-z^2 / 2) is its exponential to the 32nd power
    bell = 1.0 + part / 4.0 * (1.0 + part / 5.0)
    bell = 1.0 + part * (1.0 + part / 2.0 * (1.0 + part / 3.0 * bell))
    bell *= bell
    bell *= bell
    bell *= bell
    bell *= bell
    bell *= bell
    t = 1.0 / (1.0 + 0.3275911 * 0.7071067811865476 * far)
    tail = 1.421413741 + t * (-1.453152027 + t * 1.061405429)
    tail = 0.5 * t * bell * (0.254829592 + t * (-0.284496736 + t * tail))
    return (tail if z < 0.0 else 1.0 - tail), bell * 0.3989422804014327


@kernel(error_model="numpy", fastmath={"contract", "nsz", "arcp", "nnan"})
def _fill(
    t: Array, pixels: Array, h: Array, ray_step: Array, state: Array, half: float, limit: float
) -> None:
    """Design rows of a chunk of pixels, times the root of their weights."""
    black, contrast, blur = state[0], state[1], state[2]
    h00, h01, h02 = h[0, 0], h[0, 1], h[0, 2]
    h10, h11, h12 = h[1, 0], h[1, 1], h[1, 2]
    h20, h21, h22 = h[2, 0], h[2, 1], h[2, 2]
    s00, s01, s10, s11 = ray_step[0, 0], ray_step[0, 1], ray_step[1, 0], ray_step[1, 1]
    for i in range(CHUNK):
        x, y = pixels[RAY_X * CHUNK + i], pixels[RAY_Y * CHUNK + i]
        w = 1.0 / (h20 * x + h21 * y + h22)
        c, r = (h00 * x + h01 * y + h02) * w, (h10 * x + h11 * y + h12) * w
        cx, cy = (h00 - c * h20) * w, (h01 - c * h21) * w
        rx, ry = (h10 - r * h20) * w, (h11 - r * h21) * w
        cu, cv = cx * s00 + cy * s10, cx * s01 + cy * s11
        ru, rv = rx * s00 + ry * s10, rx * s01 + ry * s11
        per_c = 1.0 / (blur * math.sqrt(cu * cu + cv * cv))
        per_r = 1.0 / (blur * math.sqrt(ru * ru + rv * rv))
        rho = (cu * ru + cv * rv) * blur * blur * per_c * per_r
        zc, zr = (c - pixels[COLUMN * CHUNK + i]) * per_c, (r - pixels[ROW * CHUNK + i]) * per_r
        sc, gc = _edge(zc)
        sr, gr = _edge(zr)
        a, b = pixels[CELL_A * CHUNK + i], pixels[CELL_B * CHUNK + i]
        d, e = pixels[CELL_D * CHUNK + i], pixels[CELL_E * CHUNK + i]
        by_zc, by_zr = gc * (b + e * sr), gr * (d + e * sc)
        value = a + b * sc + sr * (d + e * sc)
        value += rho * e * gc * gr * (1.0 + 0.5 * rho * zc * zr)
        residual = pixels[GREY * CHUNK + i] - black - contrast * value
        size = abs(residual)
        t[12 * CHUNK + i] = size
        root = pixels[COUNTS * CHUNK + i] * min(limit / (size + 1e-9), 1.0)
        x, y = (c - half) / half, (r - half) / half
        steep = -contrast * root
        slope_c, slope_r = steep * by_zc * per_c, steep * by_zr * per_r
        lean = -(slope_c * x + slope_r * y)
        t[i], t[CHUNK + i], t[2 * CHUNK + i] = slope_c * x, slope_c * y, slope_c
        t[3 * CHUNK + i], t[4 * CHUNK + i], t[5 * CHUNK + i] = slope_r * x, slope_r * y, slope_r
        t[6 * CHUNK + i], t[7 * CHUNK + i] = lean * x, lean * y
        t[8 * CHUNK + i], t[9 * CHUNK + i] = root, root * value
        t[10 * CHUNK + i] = steep * (zc * by_zc + zr * by_zr) / blur
        t[11 * CHUNK + i] = root * residual


@kernel(fastmath={"reassoc", "contract", "nsz"})
def _add(sums: Array, design: Array) -> None:
    """Adds the products of all rows of the design."""
    for i in range(_COLUMNS):
        for j in range(i, _COLUMNS):
            total = 0.0
            for k in range(CHUNK):
                total += design[i * CHUNK + k] * design[j * CHUNK + k]
            sums[i, j] += total


@kernel
def pass_over(
    tag: TagImage, pixels: Array, h: Array, state: Array, scale: float, work: Work
) -> Pass:
    """The normal equations at the present state, as `corner_kernels.accumulate` gives them.

    Args:
        tag: what they are pixels of.
        pixels: of `edge_pixels`.
        h: (x, y, 1) to cell coordinates.
        state: black, contrast, blur in px.
        scale: noise level beyond four times which a pixel loses weight.
        work: memory.
    """
    design, sums = work
    sums[:] = 0.0
    half = (tag.cells.shape[0] - 2) / 2.0
    histogram = np.zeros(256, dtype=np.int64)
    count = total = total_squares = 0.0
    for chunk in range(len(pixels)):
        mine = pixels[chunk].reshape(-1)
        _fill(design, mine, h, tag.ray_step, state, half, 4.0 * scale)
        _add(sums, design)
        for i in range(CHUNK):
            if mine[COUNTS * CHUNK + i] > 0.0:
                histogram[min(int(design[_COLUMNS * CHUNK + i] * 4.0), 255)] += 1
                grey = mine[GREY * CHUNK + i]
                count += 1.0
                total += grey
                total_squares += grey * grey
    return Pass(
        sums[:UNKNOWNS, :UNKNOWNS].copy(),
        sums[:UNKNOWNS, UNKNOWNS].copy(),
        histogram,
        sums[UNKNOWNS, UNKNOWNS],
        sums[8, 8],
        count,
        total_squares - total * total / max(count, 1.0),
    )
