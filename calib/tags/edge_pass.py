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
    EdgePixels,
    Singles,
    map_about,
)
from freeswing.cdpr.compiled.kernels import kernel

Array = NDArray[np.float64]

_COLUMNS = UNKNOWNS + 1  # the residual stands last
_ROWS = _COLUMNS + 1  # sizes of residuals


_Three = tuple[Singles, Singles, Singles]


class Work(NamedTuple):
    """Memory of a pass: rows of the design, one after the other (13 * CHUNK), sums (12, 12)."""

    design: Singles
    sums: Array


@kernel
def new_work() -> Work:
    """Memory of one fit."""
    return Work(np.zeros(_ROWS * CHUNK, dtype=np.float32), np.zeros((_COLUMNS, _COLUMNS)))


@kernel(forceinline=True)
def _edge(z: np.float32) -> tuple[np.float32, np.float32]:
    """The Gaussian's integral (to 1e-6) and density at z, without a branch.

    Source:
        Abramowitz, Stegun 1964, Handbook of Mathematical Functions, eq. (7.1.26).
    """
    one, half = np.float32(1.0), np.float32(0.5)
    far = min(abs(z), np.float32(6.0))
    part = far * far * np.float32(-0.5 / 32.0)  # exp(-z^2 / 2): its exponential's 32nd power
    bell = one + part * np.float32(1.0 / 4.0) * (one + part * np.float32(1.0 / 5.0))
    bell = one + part * np.float32(1.0 / 3.0) * bell
    bell = one + part * (one + part * half * bell)
    bell *= bell
    bell *= bell
    bell *= bell
    bell *= bell
    bell *= bell
    t = one / (one + np.float32(0.3275911 * 0.7071067811865476) * far)
    tail = np.float32(1.421413741) + t * (np.float32(-1.453152027) + t * np.float32(1.061405429))
    tail = np.float32(0.254829592) + t * (np.float32(-0.284496736) + t * tail)
    tail *= half * t * bell
    return (tail if z < np.float32(0.0) else one - tail), bell * np.float32(0.3989422804014327)


@kernel(error_model="numpy", fastmath={"contract", "nsz", "arcp", "nnan"})
def _fill(
    t: Singles, pixels: Singles, m: int, about: Array, step: Array, state: Array, others: Array
) -> None:
    """Design rows of a chunk's first m pixels, times the root of their weights.

    `others`: half the cells along a side, and the residual from which a pixel loses weight.
    """
    h, s, levels = about.astype(np.float32), step.astype(np.float32), state.astype(np.float32)
    black, contrast, blur = levels[0], levels[1], levels[2]
    h00, h01, h02 = h[0, 0], h[0, 1], h[0, 2]
    h10, h11, h12 = h[1, 0], h[1, 1], h[1, 2]
    h20, h21 = h[2, 0], h[2, 1]
    s00, s01, s10, s11 = s[0, 0], s[0, 1], s[1, 0], s[1, 1]
    middle, limit = np.float32(others[0]), np.float32(others[1])
    one, half, least = np.float32(1.0), np.float32(0.5), np.float32(1e-9)
    per_half = one / middle
    for i in range(m):
        x, y = pixels[RAY_X * CHUNK + i], pixels[RAY_Y * CHUNK + i]
        w = one / (h20 * x + h21 * y + one)
        c, r = (h00 * x + h01 * y + h02) * w, (h10 * x + h11 * y + h12) * w
        cx, cy = (h00 - c * h20) * w, (h01 - c * h21) * w
        rx, ry = (h10 - r * h20) * w, (h11 - r * h21) * w
        cu, cv = cx * s00 + cy * s10, cx * s01 + cy * s11
        ru, rv = rx * s00 + ry * s10, rx * s01 + ry * s11
        per_c = one / (blur * math.sqrt(cu * cu + cv * cv))
        per_r = one / (blur * math.sqrt(ru * ru + rv * rv))
        rho = (cu * ru + cv * rv) * blur * blur * per_c * per_r
        zc, zr = (c - pixels[COLUMN * CHUNK + i]) * per_c, (r - pixels[ROW * CHUNK + i]) * per_r
        sc, gc = _edge(zc)
        sr, gr = _edge(zr)
        a, b = pixels[CELL_A * CHUNK + i], pixels[CELL_B * CHUNK + i]
        d, e = pixels[CELL_D * CHUNK + i], pixels[CELL_E * CHUNK + i]
        by_zc, by_zr = gc * (b + e * sr), gr * (d + e * sc)
        value = a + b * sc + sr * (d + e * sc)
        value += rho * e * gc * gr * (one + half * rho * zc * zr)
        residual = pixels[GREY * CHUNK + i] - black - contrast * value
        size = abs(residual)
        t[12 * CHUNK + i] = size
        root = pixels[COUNTS * CHUNK + i] * min(limit / (size + least), one)
        x, y = (c - middle) * per_half, (r - middle) * per_half
        steep = -contrast * root
        slope_c, slope_r = steep * by_zc * per_c, steep * by_zr * per_r
        lean = -(slope_c * x + slope_r * y)
        t[i], t[CHUNK + i], t[2 * CHUNK + i] = slope_c * x, slope_c * y, slope_c
        t[3 * CHUNK + i], t[4 * CHUNK + i], t[5 * CHUNK + i] = slope_r * x, slope_r * y, slope_r
        t[6 * CHUNK + i], t[7 * CHUNK + i] = lean * x, lean * y
        t[8 * CHUNK + i], t[9 * CHUNK + i] = root, root * value
        t[10 * CHUNK + i] = steep * (zc * by_zc + zr * by_zr) / blur
        t[11 * CHUNK + i] = root * residual


@kernel(fastmath={"reassoc", "contract", "nsz"}, forceinline=True)
def _products(one: _Three, other: _Three, m: int) -> tuple[np.float32, ...]:
    """The products of three rows with three over their first m columns, row after row."""
    a, b, c = one
    x, y, z = other
    s00 = s01 = s02 = s10 = s11 = s12 = s20 = s21 = s22 = np.float32(0.0)
    for k in range(m):
        s00, s01, s02 = s00 + a[k] * x[k], s01 + a[k] * y[k], s02 + a[k] * z[k]
        s10, s11, s12 = s10 + b[k] * x[k], s11 + b[k] * y[k], s12 + b[k] * z[k]
        s20, s21, s22 = s20 + c[k] * x[k], s21 + c[k] * y[k], s22 + c[k] * z[k]
    return s00, s01, s02, s10, s11, s12, s20, s21, s22


@kernel(forceinline=True)
def _three(design: Singles, row: int) -> _Three:
    """Three rows of the design."""
    first, second, third = row * CHUNK, (row + 1) * CHUNK, (row + 2) * CHUNK
    return design[first:second], design[second:third], design[third : third + CHUNK]


@kernel
def _add(sums: Array, design: Singles, m: int) -> None:
    """Adds the products of all rows of the design over its first m columns.

    Three by three rows, which reads each a third as often.
    """
    for i in range(0, _COLUMNS, 3):
        for j in range(i, _COLUMNS, 3):
            products = _products(_three(design, i), _three(design, j), m)
            for k in range(9):
                sums[i + k // 3, j + k % 3] += products[k]


@kernel(fastmath={"reassoc", "contract", "nsz"})
def _greys(pixels: Singles, m: int) -> tuple[float, float, float]:
    """How many of a chunk's first m pixels count, their greys' sum and that of the squares."""
    count = total = squares = 0.0
    for i in range(m):
        counts = pixels[COUNTS * CHUNK + i]
        grey = counts * pixels[GREY * CHUNK + i]
        count += counts
        total += grey
        squares += np.float64(grey) * grey
    return count, total, squares


@kernel
def pass_over(
    tag: TagImage, pixels: EdgePixels, h: Array, state: Array, scale: float, work: Work
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
    others = np.array([(tag.cells.shape[0] - 2) / 2.0, 4.0 * scale])
    about = map_about(h, pixels.origin)
    histogram = np.zeros(256, dtype=np.int64)
    count = total = total_squares = 0.0
    for chunk in range(len(pixels.counts)):
        mine, m = pixels.fields[chunk].reshape(-1), pixels.counts[chunk]
        _fill(design, mine, m, about, tag.ray_step, state, others)
        _add(sums, design, m)
        own, greys, squares = _greys(mine, m)
        count, total, total_squares = count + own, total + greys, total_squares + squares
        for i in range(m):
            if mine[COUNTS * CHUNK + i] > 0.0:
                size = int(min(design[_COLUMNS * CHUNK + i] * np.float32(4.0), np.float32(255.0)))
                histogram[np.uint64(size)] += 1
    return Pass(
        sums[:UNKNOWNS, :UNKNOWNS].copy(),
        sums[:UNKNOWNS, UNKNOWNS].copy(),
        histogram,
        sums[UNKNOWNS, UNKNOWNS],
        sums[8, 8],
        count,
        total_squares - total * total / max(count, 1.0),
    )
