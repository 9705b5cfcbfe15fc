"""One tag from a guess of its corners, compiled as a whole: box, start, pattern fit, corners."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.tags.corner_kernels import Rays, TagImage
from freeswing.calib.tags.pattern_fit import Search, fit_pattern
from freeswing.calib.tags.tag_map import corners_of_map, map_of_square
from freeswing.cdpr.compiled.kernels import kernel

Array = NDArray[np.float64]

RAYS, COVARIANCE = slice(0, 8), slice(8, 72)
BLACK, CONTRAST, BLUR, NOISE, EXPLAINED, PIXELS = range(72, 78)
NUMBERS = 78

_LEAST_EXPLAINED = 0.75  # of the grey values: what is no tag, or half of one, explains less
_LEAST_CONTRAST = 8.0  # grey levels: a fainter print cannot be told from shadows
_LEAST_BOX_PX = 8
# Cells narrower than 2.8 blur widths see their neighbours' neighbours, which the kernel leaves
# out: rendered tags at grazing angles then show a bias of about 0.05 px a blur width.
_CROWDED_CELLS = 2.8
_CROWDED_PX = 0.05
_TOO_CROWDED = 1.2  # blur widths narrower than that: neighbours blend, the bias grows faster


@kernel
def _box(corners_px: Array, n: int, height: int, width: int) -> NDArray[np.int64]:
    """Left, top, right, bottom (exclusive) of a tag with its rim; empty where there is none."""
    box = np.zeros(4, dtype=np.int64)
    low_u = high_u = corners_px[0, 0]
    low_v = high_v = corners_px[0, 1]
    total = 0.0
    for k in range(4):
        u, v = corners_px[k, 0], corners_px[k, 1]
        low_u, high_u = min(low_u, u), max(high_u, u)
        low_v, high_v = min(low_v, v), max(high_v, v)
        total += u + v
    if not math.isfinite(total):
        return box
    if high_u < 2 or high_v < 2 or low_u > width - 3:
        return box
    rim = max(high_u - low_u, high_v - low_v) / n * 1.5 + 1.0
    if rim > 1e6:
        return box
    box[0], box[1] = int(max(low_u - rim, 0.0)), int(max(low_v - rim, 0.0))
    box[2] = int(min(high_u + rim + 2.0, float(width)))
    box[3] = int(min(high_v + rim + 2.0, float(height)))
    return box


@kernel
def _ray_step(rays: Rays, corners_px: Array) -> Array:
    """How a pixel to the right and one down change the ray in the tag's middle, (2, 2) columns."""
    middle_u = middle_v = 0.0
    for k in range(4):
        middle_u, middle_v = middle_u + corners_px[k, 0], middle_v + corners_px[k, 1]
    u = min(max(int(middle_u / 4.0), 1), rays.shape[1] - 2)
    v = min(max(int(middle_v / 4.0), 1), rays.shape[0] - 2)
    step = np.empty((2, 2))
    for k in range(2):
        step[k, 0] = (rays[v, u + 1, k] - rays[v, u - 1, k]) / 2.0
        step[k, 1] = (rays[v + 1, u, k] - rays[v - 1, u, k]) / 2.0
    return step


@kernel
def fit_guess(
    image: NDArray[np.uint8],
    rays: Rays,
    guess: Array,
    cells: Array,
    blurs: Array,
    before: Array,
    limits: Array,
    tables: Array,
) -> Array:
    """A tag's fit as `NUMBERS` in a row (see `RAYS` to `PIXELS`); no pixels where it is not there.

    Args:
        image: grey, (h, w).
        rays: undistorted coordinates of every pixel, (h, w, 2).
        guess: rays and pixels of the corners TL TR BR BL, (2, 4, 2).
        cells: of the tag with its rim, (n + 2, n + 2).
        blurs: widths in px from coarse to fine.
        before: black, contrast and noise of a good prediction, or zeros.
        limits: least noise, and about how many pixels take part.
        tables: of the Gaussian.

    Source:
        Lucas, Kanade 1981, An Iterative Image Registration Technique, sec. 4: Gauss-Newton on
        grey values; JCGM 100:2008, eq. (13) for the covariance.
    """
    found = np.zeros(NUMBERS)
    n = cells.shape[0] - 2
    corners_px = guess[1]
    box = _box(corners_px, n, image.shape[0], image.shape[1])
    if box[2] - box[0] < _LEAST_BOX_PX or box[3] - box[1] < _LEAST_BOX_PX:
        return found
    start = map_of_square(guess[0], float(n))
    if start[2, 2] == 0.0:
        return found
    step = _ray_step(rays, corners_px)
    tag = TagImage(image, rays, step, cells, box, tables[0], tables[1])
    fitted = fit_pattern(tag, start, Search(blurs, limits[0], limits[1], before))
    blur = fitted.state[2]
    if fitted.explained < _LEAST_EXPLAINED or fitted.state[1] < _LEAST_CONTRAST:
        return found
    corners, spread, narrowest = corners_of_map(fitted.pattern_from_ray, fitted.covariance, n)
    pixel_ray = math.sqrt(abs(step[0, 0] * step[1, 1] - step[0, 1] * step[1, 0]))
    crowded = _CROWDED_CELLS - narrowest / pixel_ray / n / blur
    if crowded > _TOO_CROWDED:
        return found
    if crowded > 0.0:
        for i in range(8):
            spread[i, i] += (_CROWDED_PX * crowded * pixel_ray) ** 2
    for i in range(8):  # `RAYS` and `COVARIANCE`; slices would be compiled with an error's text
        found[i] = corners[i // 2, i % 2]
        for j in range(8):
            found[8 + 8 * i + j] = spread[i, j]
    found[BLACK], found[CONTRAST], found[BLUR] = fitted.state[0], fitted.state[1], blur
    found[NOISE], found[EXPLAINED], found[PIXELS] = fitted.noise, fitted.explained, fitted.pixels
    return found


@kernel
def fit_guesses(
    image: NDArray[np.uint8],
    rays: Rays,
    guesses: Array,
    cells: Array,
    before: Array,
    limits: Array,
    tables: Array,
) -> Array:
    """`fit_guess` of tags with as many cells, each from a good prediction, (n, NUMBERS).

    Args:
        image: grey, (h, w).
        rays: undistorted coordinates of every pixel, (h, w, 2).
        guesses: rays and pixels of the corners, (n, 2, 4, 2).
        cells: (n, m + 2, m + 2).
        before: black, contrast, blur in px and noise, (n, 4).
        limits: as of `fit_guess`.
        tables: of the Gaussian.

    Source:
        Lucas, Kanade 1981, An Iterative Image Registration Technique, sec. 4.
    """
    found = np.empty((len(guesses), NUMBERS))
    levels = np.empty(3)
    for k in range(len(guesses)):
        levels[0], levels[1], levels[2] = before[k, 0], before[k, 1], before[k, 3]
        blurs = before[k, 2:3]
        fit = fit_guess(image, rays, guesses[k], cells[k], blurs, levels, limits, tables)
        for i in range(NUMBERS):
            found[k, i] = fit[i]
    return found
