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
Singles = NDArray[np.float32]

# Cells of a narrower width, in blur widths: pixels near one edge then see the next one too (the
# missing part of it is S(-3.5) = 0.0002 of the contrast two blur widths from an edge).
LEAST_CELL = 5.5
REACH = 2.0
"""Pixels within so many blur widths of an edge hold erf(2) = 99.5 % of what all pixels tell."""
MARGIN_PX = 0.3  # by which a prediction may be off without losing pixels
_INSIDE = (0.2, 0.5, 0.8)  # places along a cell at which a pixel tells its grey
_RIM = 0.45  # places in the white rim, in cells from the border
_NEWTON_STEPS = 2  # from one cell corner to the next, in pixels: an error of 1 % a step
CHUNK = 512
FIELDS = 10
GREY, RAY_X, RAY_Y, COLUMN, ROW, CELL_A, CELL_B, CELL_D, CELL_E, COUNTS = range(FIELDS)
_LOW_BITS = 32  # of a place: u; above them v


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


class EdgePixels(NamedTuple):
    """The pixels that tell of a tag, in chunks.

    Attributes:
        fields: grey, ray x and y from `origin`, column and row of the nearest cell corner, a, b, d,
            e of the module's formula, and 1 for a pixel, 0 for what fills up the last chunk;
            (chunks, FIELDS, CHUNK), in single precision (1e-5 px).
        origin: ray in the tag's middle, (2,).
        counts: pixels of each chunk, (chunks,).
    """

    fields: Singles
    origin: Array
    counts: NDArray[np.int64]


class Walk(NamedTuple):
    """What a walk goes along and writes to: which pixels of the box were taken, and their list.

    Attributes:
        corners: pixels of the corners of all cells, (n + 1, n + 1, 2).
        reach: px to either side of an edge.
        taken: of the box, row after row.
        places: v and, in the `_LOW_BITS`, u of each pixel.
        box: left, top, right, bottom within the image.
    """

    corners: Array
    reach: float
    taken: NDArray[np.uint8]
    places: NDArray[np.int64]
    box: NDArray[np.int64]


@kernel(forceinline=True)
def _take(walk: Walk, count: int, at: int, place: int) -> int:
    """The count after a pixel, which is listed when it is new. Unsigned numbers index faster."""
    if walk.taken[np.uint64(at)]:
        return count
    walk.taken[np.uint64(at)] = 1
    walk.places[np.uint64(count)] = place
    return count + 1


@kernel
def _along(walk: Walk, count: int, row: int, column: int, is_down: bool, step: int) -> int:
    """The count after the pixels near the edge that goes down, or to the right, from a cell corner.

    Every `step`-th row of them. Corners by number: to hand over parts of arrays takes longer.
    """
    box, corners = walk.box, walk.corners
    below, after = (row + 1, column) if is_down else (row, column + 1)
    p0, p1 = corners[row, column, 0], corners[row, column, 1]
    q0, q1 = corners[below, after, 0], corners[below, after, 1]
    du, dv = q0 - p0, q1 - p1
    upright = abs(dv) >= abs(du)
    along = dv if upright else du
    if not abs(along) > 1e-9:
        return count
    slope = (du if upright else dv) / along
    wide = walk.reach * math.sqrt(1.0 + slope * slope)
    a0, b0 = (p1, p0) if upright else (p0, p1)
    a1 = q1 if upright else q0
    own, other = (1, 0) if upright else (0, 1)
    low, high = box[other], box[2 + other] - 1
    first, last = math.ceil(min(a0, a1)), math.floor(max(a0, a1))
    if step > 1:  # rows skipped by their place in the image, turned from column to column
        first += (step - (first + int(b0)) % step) % step
    if first < box[own]:
        first += (box[own] - first + step - 1) // step * step
    last = min(last, box[2 + own] - 1)
    width = box[2] - box[0]
    ahead, aside = (width, 1) if upright else (1, width)
    place_ahead, place_aside = (1 << _LOW_BITS, 1) if upright else (1, 1 << _LOW_BITS)
    for a in range(first, last + 1, step):
        middle = b0 + slope * (a - a0)
        start = max(math.ceil(middle - wide), low)
        end = min(math.floor(middle + wide), high) + 1
        if count + end - start >= len(walk.places):
            return count
        at = (a - box[own]) * ahead + (start - low) * aside
        place = a * place_ahead + start * place_aside
        for _ in range(end - start):
            count = _take(walk, count, at, place)
            at += aside
            place += place_aside
    return count


@kernel
def _inside(walk: Walk, count: int) -> int:
    """The count after a few pixels in each cell and in the rim."""
    corners = walk.corners
    n = corners.shape[0] - 1
    left, top, right, bottom = walk.box
    for r in range(-1, n + 1):
        rows = 1 if r < 0 or r == n else len(_INSIDE)
        for c in range(-1, n + 1):
            columns = 1 if c < 0 or c == n else len(_INSIDE)
            r0, c0 = min(max(r, 0), n - 1), min(max(c, 0), n - 1)
            u0, v0 = corners[r0, c0, 0], corners[r0, c0, 1]
            right_u, right_v = corners[r0, c0 + 1, 0] - u0, corners[r0, c0 + 1, 1] - v0
            down_u, down_v = corners[r0 + 1, c0, 0] - u0, corners[r0 + 1, c0, 1] - v0
            for i in range(rows):
                fr = _INSIDE[i] if rows > 1 else (-_RIM if r < 0 else 1.0 + _RIM)
                for j in range(columns):
                    fc = _INSIDE[j] if columns > 1 else (-_RIM if c < 0 else 1.0 + _RIM)
                    u = math.floor(u0 + fc * right_u + fr * down_u + 0.5)
                    v = math.floor(v0 + fc * right_v + fr * down_v + 0.5)
                    within = left <= u < right and top <= v < bottom
                    if within and count < len(walk.places):
                        at = (v - top) * (right - left) + u - left
                        count = _take(walk, count, at, (v << _LOW_BITS) + u)
    return count


@kernel
def _walked(tag: TagImage, corners: Array, reach_px: float, most: float) -> NDArray[np.int64]:
    """Pixels along the edges and a few in each cell, as `Walk.places` has them."""
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
    taken = np.zeros((box[3] - box[1]) * (box[2] - box[0]), dtype=np.uint8)
    walk = Walk(corners, reach_px, taken, np.empty(room, dtype=np.int64), box)
    count = np.int64(0)  # a plain 0 is a type of its own, for which all would be compiled again
    for r in range(n + 1):
        for c in range(n + 1):
            if r < n and cells[r + 1, c] != cells[r + 1, c + 1]:
                count = _along(walk, count, r, c, True, step)
            if c < n and cells[r, c + 1] != cells[r + 1, c + 1]:
                count = _along(walk, count, r, c, False, step)
    count = _inside(walk, count)
    return walk.places[:count]


@kernel
def edge_pixels(tag: TagImage, h: Array, blur: float, most: float) -> EdgePixels:
    """The pixels that tell of a tag at the map `h`.

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
    n = tag.cells.shape[0] - 2
    back, origin = inverted(h), np.empty(2)
    for k in range(2):
        origin[k] = back[k, 0] * 0.5 * n + back[k, 1] * 0.5 * n + back[k, 2]
        origin[k] /= back[2, 0] * 0.5 * n + back[2, 1] * 0.5 * n + back[2, 2]
    about = map_about(h, origin)
    near = _around_corners(tag.cells)
    chunks = (len(places) + CHUNK - 1) // CHUNK
    counts = np.empty(chunks, dtype=np.int64)
    fields, corner = np.empty((chunks, FIELDS, CHUNK), dtype=np.float32), np.empty(CHUNK, np.int32)
    for chunk in range(chunks):
        mine, out = places[chunk * CHUNK : (chunk + 1) * CHUNK], fields[chunk].reshape(-1)
        counts[chunk] = len(mine)
        _read(tag, mine, origin, out)
        _put_to_corners(out, corner, about, n)
        for i in range(CHUNK):
            for field in range(4):
                out[(CELL_A + field) * CHUNK + i] = near[np.uint64(corner[i]), field]
    return EdgePixels(fields, origin, counts)


@kernel
def map_about(h: Array, origin: Array) -> Array:
    """The map `h` for rays counted from `origin`, scaled to 1 there.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 2.3: maps of the
        plane composed.
    """
    about = h.copy()
    for i in range(3):
        about[i, 2] += h[i, 0] * origin[0] + h[i, 1] * origin[1]
    scale = about[2, 2]
    for i in range(3):
        for j in range(3):
            about[i, j] /= scale
    return about


@kernel
def _around_corners(cells: Array) -> Singles:
    """a, b, d, e of the module's formula for each cell corner, row after row, ((n + 1)^2, 4)."""
    n = cells.shape[0] - 2
    found = np.empty(((n + 1) * (n + 1), 4), dtype=np.float32)
    for m in range(n + 1):
        for k in range(n + 1):
            a, b, d = cells[m, k], cells[m, k + 1], cells[m + 1, k]
            line = found[m * (n + 1) + k]
            line[0], line[1], line[2] = a, b - a, d - a
            line[3] = cells[m + 1, k + 1] - d - b + a
    return found


@kernel
def _read(tag: TagImage, places: NDArray[np.int64], origin: Array, out: Singles) -> None:
    """Grey values and rays of a chunk's pixels, and what fills it up."""
    image, rays = tag.image, tag.rays
    x0, y0 = origin
    for i in range(len(places)):
        v, u = np.uint64(places[i] >> _LOW_BITS), np.uint64(places[i] & ((1 << _LOW_BITS) - 1))
        out[GREY * CHUNK + i] = image[v, u]
        out[RAY_X * CHUNK + i] = rays[v, u, 0] - x0
        out[RAY_Y * CHUNK + i] = rays[v, u, 1] - y0
        out[COUNTS * CHUNK + i] = 1.0
    for i in range(len(places), CHUNK):
        out[GREY * CHUNK + i] = out[RAY_X * CHUNK + i] = out[RAY_Y * CHUNK + i] = 0.0
        out[COUNTS * CHUNK + i] = 0.0


@kernel(error_model="numpy")
def _put_to_corners(out: Singles, corner: NDArray[np.int32], about: Array, n: int) -> None:
    """Nearest cell corners of a chunk's pixels.

    Pixels outside, or where no ray of the lens is, are put to the middle and do not count.
    """
    h = about.astype(np.float32)
    h00, h01, h02 = h[0, 0], h[0, 1], h[0, 2]
    h10, h11, h12 = h[1, 0], h[1, 1], h[1, 2]
    h20, h21 = h[2, 0], h[2, 1]
    none, half, one, most = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(n)
    for i in range(CHUNK):
        x, y = out[RAY_X * CHUNK + i], out[RAY_Y * CHUNK + i]
        w = one / (h20 * x + h21 * y + one)
        c, r = (h00 * x + h01 * y + h02) * w, (h10 * x + h11 * y + h12) * w
        inside = (c > -one) & (r > -one) & (c < most + one) & (r < most + one)
        c, r = (c if inside else none), (r if inside else none)
        column, row = np.int32(max(c + half, none)), np.int32(max(r + half, none))
        column, row = min(column, np.int32(n)), min(row, np.int32(n))
        corner[i] = row * np.int32(n + 1) + column
        out[COLUMN * CHUNK + i], out[ROW * CHUNK + i] = column, row
        out[RAY_X * CHUNK + i] = x if inside else none
        out[RAY_Y * CHUNK + i] = y if inside else none
        out[COUNTS * CHUNK + i] *= one if inside else none
