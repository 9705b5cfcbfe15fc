"""The pixels of one printed tag that tell where it is: those along the edges of its print.

A pixel two blur widths from the nearest edge says nothing of the corners, and three of four pixels
of a large tag are such. The edges between black and white cells are walked in the image, and a
few pixels inside each cell tell its grey. Each pixel keeps the cells around its nearest
cell corner, with which the blurred pattern there is

    B = a + b S(zc) + d S(zr) + e S(zc) S(zr) + twist,   z = distance from the edge / blur width

(S is the Gaussian's integral); edges farther away are too far to be seen, see `LEAST_CELL`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.tags.corner_kernels import TagImage
from freeswing.calib.tags.tag_map import inverted
from freeswing.cdpr.compiled.kernels import kernel

Array = NDArray[np.float64]

# Cells of a narrower width, in blur widths: pixels near one edge then see the next one too (the
# missing part of it is S(-3.5) = 0.0002 of the contrast two blur widths from an edge).
LEAST_CELL = 5.5
REACH = 2.0
"""Pixels within so many blur widths of an edge hold erf(2) = 99.5 % of what all pixels tell."""
MARGIN_PX = 0.3  # by which a prediction may be off without losing pixels
_INSIDE = (0.2, 0.5, 0.8)  # places along a cell at which a pixel tells its grey
_RIM = 0.45  # places in the white rim, in cells from the border
_NEWTON_STEPS = 3  # from one cell corner to the next, in pixels: an error of 1 % a step
CHUNK = 128
FIELDS = 10
GREY, RAY_X, RAY_Y, COLUMN, ROW, CELL_A, CELL_B, CELL_D, CELL_E, COUNTS = range(FIELDS)


@kernel
def lattice_pixels(tag: TagImage, h: Array) -> Array:
    """Pixels (u, v) of the corners of all cells, by row and column, (n + 1, n + 1, 2).

    Each is found by Newton's steps through the grid of rays, so that any lens serves.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 2.3; Press et al.
        2007, Numerical Recipes, sec. 9.6: Newton's method.
    """
    rays = tag.rays
    n = tag.cells.shape[0] - 2
    height, width = rays.shape[0], rays.shape[1]
    back = inverted(h)
    found = np.empty((n + 1, n + 1, 2))
    u, v = (tag.box[0] + tag.box[2]) / 2.0, (tag.box[1] + tag.box[3]) / 2.0
    for r in range(n + 1):
        for c in range(n + 1):
            w = 1.0 / (back[2, 0] * c + back[2, 1] * r + back[2, 2])
            x = (back[0, 0] * c + back[0, 1] * r + back[0, 2]) * w
            y = (back[1, 0] * c + back[1, 1] * r + back[1, 2]) * w
            if c == 0 and r > 0:
                u, v = found[r - 1, 0, 0], found[r - 1, 0, 1]
            for _ in range(_NEWTON_STEPS):
                i = min(max(int(u + 0.5), 1), width - 2)
                j = min(max(int(v + 0.5), 1), height - 2)
                xu = (rays[j, i + 1, 0] - rays[j, i - 1, 0]) / 2.0
                yu = (rays[j, i + 1, 1] - rays[j, i - 1, 1]) / 2.0
                xv = (rays[j + 1, i, 0] - rays[j - 1, i, 0]) / 2.0
                yv = (rays[j + 1, i, 1] - rays[j - 1, i, 1]) / 2.0
                dx, dy = x - rays[j, i, 0], y - rays[j, i, 1]
                area = xu * yv - xv * yu
                u = i + (yv * dx - xv * dy) / area
                v = j + (xu * dy - yu * dx) / area
                if not (abs(u) < 1e6 and abs(v) < 1e6):
                    u, v = float(i), float(j)
            found[r, c, 0], found[r, c, 1] = u, v
    return found


class Walk(NamedTuple):
    """What a walk writes to: which pixels of the box were taken, and their list.

    Attributes:
        taken: (h, w) of the box.
        places: u, v, (most, 2).
        box: left, top, right, bottom within the image.
    """

    taken: NDArray[np.uint8]
    places: NDArray[np.int32]
    box: NDArray[np.int64]


@kernel(forceinline=True)
def _take(walk: Walk, count: int, u: int, v: int) -> int:
    """The count after a pixel, which is listed when it is new and inside the box."""
    taken, places, box = walk
    if u < box[0] or u >= box[2] or v < box[1] or v >= box[3] or count >= places.shape[0]:
        return count
    if taken[v - box[1], u - box[0]]:
        return count
    taken[v - box[1], u - box[0]] = 1
    places[count, 0], places[count, 1] = u, v
    return count + 1


@kernel
def _along(walk: Walk, count: int, p: Array, q: Array, reach_px: float, step: int) -> int:
    """The count after the pixels within `reach_px` of the edge p-q; every `step`-th row of them."""
    du, dv = q[0] - p[0], q[1] - p[1]
    upright = abs(dv) >= abs(du)
    along = dv if upright else du
    if not abs(along) > 1e-9:
        return count
    slope = (du if upright else dv) / along
    wide = reach_px * math.sqrt(1.0 + slope * slope)
    a0, b0 = (p[1], p[0]) if upright else (p[0], p[1])
    a1 = q[1] if upright else q[0]
    first, last = math.ceil(min(a0, a1)), math.floor(max(a0, a1))
    # Rows are skipped by their place in the image, turned from column to column of the pattern.
    first += (step - (first + int(b0)) % step) % step
    for a in range(first, last + 1, step):
        middle = b0 + slope * (a - a0)
        for b in range(math.ceil(middle - wide), math.floor(middle + wide) + 1):
            count = _take(walk, count, b, a) if upright else _take(walk, count, a, b)
    return count


@kernel
def _inside(walk: Walk, count: int, corners: Array) -> int:
    """The count after a few pixels in each cell and in the rim."""
    n = corners.shape[0] - 1
    for r in range(-1, n + 1):
        for c in range(-1, n + 1):
            r0, c0 = min(max(r, 0), n - 1), min(max(c, 0), n - 1)
            p, right, down = corners[r0, c0], corners[r0, c0 + 1], corners[r0 + 1, c0]
            for fr in _INSIDE:
                if r < 0 or r == n:
                    fr = -_RIM if r < 0 else 1.0 + _RIM
                for fc in _INSIDE:
                    if c < 0 or c == n:
                        fc = -_RIM if c < 0 else 1.0 + _RIM
                    u = p[0] + fc * (right[0] - p[0]) + fr * (down[0] - p[0])
                    v = p[1] + fc * (right[1] - p[1]) + fr * (down[1] - p[1])
                    count = _take(walk, count, math.floor(u + 0.5), math.floor(v + 0.5))
    return count


@kernel
def _walked(tag: TagImage, corners: Array, reach_px: float, most: float) -> NDArray[np.int32]:
    """Pixels (u, v) along the edges and a few in each cell, (n, 2)."""
    cells, box = tag.cells, tag.box
    n = cells.shape[0] - 2
    length = 0.0
    for r in range(n + 1):
        for c in range(n + 1):
            if r < n and cells[r + 1, c] != cells[r + 1, c + 1]:
                length += math.hypot(
                    corners[r + 1, c, 0] - corners[r, c, 0], corners[r + 1, c, 1] - corners[r, c, 1]
                )
            if c < n and cells[r, c + 1] != cells[r + 1, c + 1]:
                length += math.hypot(
                    corners[r, c + 1, 0] - corners[r, c, 0], corners[r, c + 1, 1] - corners[r, c, 1]
                )
    step = max(1, int(2.0 * reach_px * length / most + 0.5))
    room = int(2.0 * reach_px * length * 1.5 / step) + 200 + 9 * (n + 2) ** 2
    taken = np.zeros((box[3] - box[1], box[2] - box[0]), dtype=np.uint8)
    walk = Walk(taken, np.empty((room, 2), dtype=np.int32), box)
    count = np.int64(0)  # a plain 0 is a type of its own, for which all would be compiled again
    for r in range(n + 1):
        for c in range(n + 1):
            if r < n and cells[r + 1, c] != cells[r + 1, c + 1]:
                count = _along(walk, count, corners[r, c], corners[r + 1, c], reach_px, step)
            if c < n and cells[r, c + 1] != cells[r + 1, c + 1]:
                count = _along(walk, count, corners[r, c], corners[r, c + 1], reach_px, step)
    count = _inside(walk, count, corners)
    return walk.places[:count]


@kernel(error_model="numpy")
def edge_pixels(tag: TagImage, h: Array, blur: float, most: float) -> Array:
    """The pixels that tell of a tag at the map `h`, in chunks, (chunks, FIELDS, CHUNK).

    Fields: grey, ray x and y, column and row of the nearest cell corner, a, b, d, e of the module's
    formula, and 1 for a pixel, 0 for what fills up the last chunk.

    Args:
        tag: the pixels.
        h: (x, y, 1) to cell coordinates, the tag's black border at 0 ... n.
        blur: width in px.
        most: about so many along the edges.

    Source:
        Kay 1993, Fundamentals of Statistical Signal Processing: Estimation Theory, sec. 3.6: a
        sample tells by the square of its slope, for a Gaussian edge exp(-z^2).
    """
    places = _walked(tag, lattice_pixels(tag, h), REACH * blur + MARGIN_PX, most)
    image, rays, cells = tag.image, tag.rays, tag.cells
    n = cells.shape[0] - 2
    found = np.empty((len(places) // CHUNK + 1, FIELDS, CHUNK))
    count = 0
    for p in range(len(places)):
        u, v = places[p]
        x, y = rays[v, u, 0], rays[v, u, 1]
        w = 1.0 / (h[2, 0] * x + h[2, 1] * y + h[2, 2])
        c = (h[0, 0] * x + h[0, 1] * y + h[0, 2]) * w
        r = (h[1, 0] * x + h[1, 1] * y + h[1, 2]) * w
        if not (c > -1.0 and r > -1.0 and c < n + 1.0 and r < n + 1.0):
            continue  # also where no ray of the lens is
        k, m = min(max(int(c + 0.5), 0), n), min(max(int(r + 0.5), 0), n)
        a, b, d = cells[m, k], cells[m, k + 1], cells[m + 1, k]
        out, i = found[count // CHUNK], count % CHUNK
        out[GREY, i], out[RAY_X, i], out[RAY_Y, i] = image[v, u], x, y
        out[COLUMN, i], out[ROW, i] = k, m
        out[CELL_A, i], out[CELL_B, i], out[CELL_D, i] = a, b - a, d - a
        out[CELL_E, i], out[COUNTS, i] = cells[m + 1, k + 1] - d - b + a, 1.0
        count += 1
    if count == 0:
        return found[:0]
    chunks = (count + CHUNK - 1) // CHUNK
    for p in range(count, chunks * CHUNK):
        for field in range(FIELDS):
            found[chunks - 1, field, p % CHUNK] = found[0, field, 0]
        found[chunks - 1, COUNTS, p % CHUNK] = 0.0
    return found[:chunks]
