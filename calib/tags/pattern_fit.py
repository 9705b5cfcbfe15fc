"""Gauss-Newton on the pixels of one printed tag (see `calib.tags.corner_kernels`)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.tags.corner_kernels import UNKNOWNS, Pass, TagImage, accumulate, new_arrays
from freeswing.calib.tags.tag_map import compose

Array = NDArray[np.float64]

BLACK, CONTRAST, BLUR = 8, 9, 10
LEAST_BLUR = 0.289  # of the pixel's own square, in px
MOST_BLUR = 6.0
LEAST_ERROR = 0.02  # of the contrast: in a clean image every edge pixel would be an outlier
MOST_FREE_PASSES = 25  # sharp small tags settle slowly, others in four to six
FIRST_BLACK, FIRST_CONTRAST = 40.0, 160.0  # where nothing is predicted
LEAST_CONTRAST = 10.0
ANY_RESIDUAL = 1e6
FARTHEST = 2.0  # the longest step, in half sides of the tag
SETTLING, SETTLED = 0.02, 0.006  # steps from which all pixels take part, and from which it is done


class Search(NamedTuple):
    """How to search.

    Attributes:
        blurs: widths held on the first passes, which widen the catch; then the blur is free,
            started at the last of them.
        noise: least standard deviation of a pixel.
        most_pixels: about so many of the box take part in the last pass, spread evenly.
        guess: black, contrast and noise of a good prediction (contrast 0: none): the first pass is
            then also the last, if it moves little.
    """

    blurs: Array
    noise: float
    most_pixels: float
    guess: Array


class PatternFit(NamedTuple):
    """What `fit_pattern` gives.

    Attributes:
        pattern_from_ray: (3, 3).
        covariance: of the small homography, (8, 8), zero where the fit has not settled.
        state: black, contrast, blur in px.
        noise: standard deviation of a pixel.
        explained: share of the grey values' variance; 0 where the fit has failed.
        pixels: that took part.
        last: step, in half sides of the tag.
    """

    pattern_from_ray: Array
    covariance: Array
    state: Array
    noise: float
    explained: float
    pixels: float
    last: float


@numba.njit(cache=True, nogil=True)
def _noise_from(histogram: NDArray[np.int64], count: float) -> float:
    """Noise level from the median of |residual|, grey levels."""
    seen = 0
    for k in range(256):
        seen += histogram[k]
        if 2 * seen >= count:
            below = seen - histogram[k]
            inside = (count / 2.0 - below) / max(histogram[k], 1)
            return max((k + inside) / 4.0 * 1.4826, 0.4)
    return 64.0


@numba.njit(cache=True, nogil=True)
def _levels(seen: Pass, state: Array) -> Array:
    """The state with black and contrast by linear least squares at the first guess of the place."""
    normal, right, found = seen.normal, seen.right, state.copy()
    a, b, c = normal[8, 8], normal[8, 9], normal[9, 9]
    determinant = a * c - b * b
    if determinant > 1e-9:
        found[0] += (c * right[8] - b * right[9]) / determinant
        found[1] += (a * right[9] - b * right[8]) / determinant
    found[1] = max(found[1], LEAST_CONTRAST)
    return found


@numba.njit(cache=True, nogil=True)
def _solvable(seen: Pass, held: bool) -> tuple[Array, Array]:
    """The pass's whole normal matrix and right side, the blur `held` or not."""
    normal, right = seen.normal.copy(), seen.right.copy()
    for i in range(UNKNOWNS):
        for j in range(i):
            normal[i, j] = normal[j, i]
    if held:
        normal[BLUR, :] = 0.0
        normal[:, BLUR] = 0.0
        normal[BLUR, BLUR] = 1.0
        right[BLUR] = 0.0
    for i in range(UNKNOWNS):
        normal[i, i] *= 1.0 + 1e-9
        normal[i, i] += 1e-9
    return normal, right


@numba.njit(cache=True, nogil=True)
def _moved(state: Array, change: NDArray[np.floating]) -> tuple[Array, float]:
    """The state after a step; and how its blur changed, by half of itself at the most."""
    blur = state[2]
    blur_change = min(max(change[BLUR], -0.3 * blur), 0.5 * blur)
    blur_change = min(max(blur + blur_change, LEAST_BLUR), MOST_BLUR) - blur
    moved = np.array([state[0] + change[BLACK], state[1] + change[CONTRAST], blur + blur_change])
    return moved, blur_change


@numba.njit(cache=True, nogil=True)
def _strides(box: NDArray[np.int64], most_pixels: float) -> tuple[int, int]:
    """Of the pixels that take part, at the end and in the first passes."""
    area = max((box[2] - box[0]) * (box[3] - box[1]), 1.0)
    fine = max(1, int(area / most_pixels + 0.5))
    return fine, max(fine, int(area / 1600.0))


@numba.njit(cache=True, nogil=True)
def _length(change: Array) -> float:
    """Largest change of the small homography."""
    largest = 0.0
    for i in range(8):
        largest = max(largest, abs(change[i]))
    return largest


@numba.njit(cache=True, nogil=True)
def fit_pattern(tag: TagImage, pattern_from_ray: Array, search: Search) -> PatternFit:
    """Gauss-Newton from coarse to fine, from a first guess of the pattern's map (3, 3)."""
    h = pattern_from_ray.copy()
    half = (tag.cells.shape[0] - 2) / 2.0
    blurs, guess = search.blurs, search.guess
    state = np.array([FIRST_BLACK, FIRST_CONTRAST, blurs[0]])
    covariance, change, arrays = np.zeros((8, 8)), np.zeros(UNKNOWNS), new_arrays()
    fine, coarse = _strides(tag.box, search.most_pixels)
    scale, predicted = ANY_RESIDUAL, guess[1] > 0.0
    if predicted:
        state[0], state[1] = guess[0], guess[1]
        scale = 2.0 * guess[2] + 2.0
    held = len(blurs) - 1
    noise, pixels, last = 0.0, 0.0, 1e9
    for iteration in range(held + MOST_FREE_PASSES):
        free = iteration >= held
        if iteration <= held:
            state[2] = blurs[iteration]
        settled = free and last < SETTLING
        at_once = predicted and iteration == 0
        stride = fine if settled or at_once or iteration > held + 3 else coarse
        if iteration == 0 and not predicted:
            state = _levels(accumulate(tag, h, state, stride, ANY_RESIDUAL, arrays), state)
        seen = accumulate(tag, h, state, stride, scale, arrays)
        if seen.pixels < 4 * UNKNOWNS:
            return PatternFit(h, covariance, state, 0.0, 0.0, pixels, last)
        at_least = state[2] <= LEAST_BLUR and seen.right[BLUR] < 0.0
        normal, right = _solvable(seen, not free or at_least)
        change[:] = np.linalg.solve(normal, right)
        state, blur_change = _moved(state, change)
        largest = _length(change)
        if largest > FARTHEST:
            change[:8] *= FARTHEST / largest
        h = compose(h, change, half)
        last = max(largest, 0.5 * abs(blur_change) / state[2] if free else 0.0)
        scale = max(
            _noise_from(seen.histogram, seen.pixels), 0.5 * search.noise, LEAST_ERROR * state[1]
        )
        # What the step leaves, to first order.
        after = max(seen.squares - float(change @ right), 0.0)
        variance = after / max(seen.weights - UNKNOWNS, 1.0)
        noise, pixels = math.sqrt(variance), seen.pixels
        if free and stride == fine and last < SETTLED:
            explained = 1.0 - float(after) / max(seen.spread, 1e-9)
            inverse = np.linalg.inv(normal)
            covariance[:] = inverse[:8, :8] * max(variance, search.noise * search.noise)
            return PatternFit(h, covariance, state, noise, explained, pixels, last)
    return PatternFit(h, covariance, state, noise, 0.0, pixels, last)
