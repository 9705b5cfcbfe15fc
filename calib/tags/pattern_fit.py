"""Gauss-Newton on the pixels of one printed tag (see `calib.tags.corner_kernels`)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.tags.corner_kernels import UNKNOWNS, Pass, TagImage, accumulate, new_arrays
from freeswing.calib.tags.edge_pass import new_work, pass_over
from freeswing.calib.tags.edge_pixels import LEAST_CELL, edge_pixels
from freeswing.calib.tags.tag_map import blur_at_centre, compose
from freeswing.cdpr.compiled.kernels import kernel
from freeswing.cdpr.elimination import eliminate

Array = NDArray[np.float64]

_Singular = np.linalg.LinAlgError
BLACK, CONTRAST, BLUR = 8, 9, 10
LEAST_BLUR = 0.289  # of the pixel's own square, in px
MOST_BLUR = 6.0  # px; wider ones take tags of 80 px and more, and are no picture to measure in
LEAST_ERROR = 0.02  # of the contrast, what print lacks: else a clean image is all outliers
MOST_FREE_PASSES = 25  # sharp small tags settle slowly, others in four to six
FIRST_BLACK, FIRST_CONTRAST = 40.0, 160.0  # where nothing is predicted
LEAST_CONTRAST = 10.0
ANY_RESIDUAL = 1e6
FARTHEST = 2.0  # the longest step, in cells
SETTLING, SETTLED = 0.02, 0.006  # steps from which all pixels take part, and from which it is done
TOO_NARROW = -1.0
SHARP = 0.5  # px; no lens is sharper, but the blur of a fit may pass by smaller values
MOST_EDGE_PASSES = 20  # one or two from a prediction, three from a search, more where covered
EDGE_SETTLED = 0.12
"""A step in cells, times half the tag's cells, of so many blur widths is the last along the edges:
with eight cells one of d = 0.03 blur widths. It leaves the blur too wide by d^2 / 4 of it, 2e-4,
and corners wrong by d^3 / 12, which is nothing."""
EDGE_LOST = 0.5  # after a longer one other pixels are near the edges
OUTLYING = 0.02
"""Where more of the pixels than this lie beyond four noise levels (6e-5 do by chance), part of the
tag is covered: weights then have to settle too, at the residuals' own noise level."""
COVERED_SETTLED = 0.02  # blur widths: what weights then still move is a tenth of a deviation
COVERED_SCALE = 1.3  # from one noise level to the next


class Search(NamedTuple):
    """How to search.

    Attributes:
        blurs: widths held on the first passes, which widen the catch; then the blur is free,
            started at the last of them.
        noise: least standard deviation of a pixel.
        most_pixels: about so many take part in the last pass, along the edges; evenly from the
            whole box where cells are narrow.
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
        last: step, in cells, or half of that of the blur over the blur.
    """

    pattern_from_ray: Array
    covariance: Array
    state: Array
    noise: float
    explained: float
    pixels: float
    last: float


@kernel
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


@kernel
def _outlying(seen: Pass, scale: float) -> float:
    """Share of the pixels whose residual is beyond four noise levels."""
    count = 0
    for k in range(min(int(16.0 * scale) + 1, 255), 256):
        count += seen.histogram[k]
    return count / seen.pixels


@kernel
def _settled_at(seen: Pass, scale: float, next_scale: float, at_last: bool) -> float:
    """Step along the edges, as `EDGE_SETTLED` has it, from which a fit is done; 0: in no case."""
    if _outlying(seen, next_scale) <= OUTLYING:
        return EDGE_SETTLED
    if scale >= COVERED_SCALE * next_scale:
        return 0.0
    # Pixels that go in and out of the law keep some prints of a sharp film from settling.
    return EDGE_SETTLED if at_last else COVERED_SETTLED


@kernel
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


@kernel
def _solvable(seen: Pass, held: bool) -> tuple[Array, Array]:
    """The pass's whole normal matrix and right side, the blur `held` or not."""
    normal, right = seen.normal.copy(), seen.right.copy()
    for i in range(UNKNOWNS):
        for j in range(i):
            normal[i, j] = normal[j, i]
    if held:
        for i in range(UNKNOWNS):
            normal[BLUR, i] = normal[i, BLUR] = 0.0
        normal[BLUR, BLUR] = 1.0
        right[BLUR] = 0.0
    for i in range(UNKNOWNS):
        normal[i, i] *= 1.0 + 1e-9
        normal[i, i] += 1e-9
    return normal, right


@kernel
def _moved(state: Array, change: Array) -> tuple[Array, float]:
    """The state after a step; and how its blur changed, by half of itself at the most."""
    blur = state[2]
    blur_change = min(max(change[BLUR], -0.3 * blur), 0.5 * blur)
    blur_change = min(max(blur + blur_change, LEAST_BLUR), MOST_BLUR) - blur
    moved = np.empty(3)
    moved[0], moved[1] = state[0] + change[BLACK], state[1] + change[CONTRAST]
    moved[2] = blur + blur_change
    return moved, blur_change


@kernel
def _strides(box: NDArray[np.int64], most_pixels: float) -> tuple[int, int]:
    """Of the pixels that take part, at the end and in the first passes."""
    area = max((box[2] - box[0]) * (box[3] - box[1]), 1.0)
    fine = max(1, int(area / most_pixels + 0.5))
    return fine, max(fine, int(area / 1600.0))


@kernel
def _length(change: Array) -> float:
    """Largest change of the small homography."""
    largest = 0.0
    for i in range(8):
        largest = max(largest, abs(change[i]))
    return largest


class _Step(NamedTuple):
    """A pass's result.

    Attributes:
        h: the map after it.
        state: black, contrast, blur in px after it.
        normal: matrix that was solved.
        size: of the step, the largest change of the small homography, in cells.
        blur_step: of the blur over the blur.
        scale: noise level for the next pass.
        variance: of a pixel, of what the step leaves to first order.
        explained: share of the grey values' variance.
    """

    h: Array
    state: Array
    normal: Array
    size: float
    blur_step: float
    scale: float
    variance: float
    explained: float


@kernel
def _is_least(seen: Pass, state: Array) -> bool:
    """Whether the blur has its least value, and the pass would make it less."""
    return state[2] <= LEAST_BLUR and seen.right[BLUR] < 0.0


@kernel
def _step(seen: Pass, h: Array, state: Array, half: float, noise: float, held: bool) -> _Step:
    """Gauss-Newton's step of a pass, the blur `held` or free."""
    normal, right = _solvable(seen, held)
    change = right.copy()
    eliminate(normal.copy(), change.reshape(-1, 1))
    moved, blur_change = _moved(state, change)
    largest = _length(change)
    shorter = FARTHEST / largest if largest > FARTHEST else 1.0
    explained = 0.0
    for i in range(UNKNOWNS):
        change[i] *= shorter if i < 8 else 1.0
        explained += change[i] * right[i]
    if not math.isfinite(explained):
        raise _Singular("A pass over a tag's pixels gave no step.")
    scale = max(_noise_from(seen.histogram, seen.pixels), 0.5 * noise, LEAST_ERROR * moved[1])
    after = max(seen.squares - explained, 0.0)
    return _Step(
        compose(h, change, half),
        moved,
        normal,
        largest,
        abs(blur_change) / moved[2],
        scale,
        after / max(seen.weights - UNKNOWNS, 1.0),
        1.0 - after / max(seen.spread, 1e-9),
    )


@kernel
def _given(step: _Step, least: float, pixels: float, last: float) -> PatternFit:
    """The fit of a last step; `least` is the smallest variance of a pixel."""
    whole, covariance = np.zeros((UNKNOWNS, UNKNOWNS)), np.empty((8, 8))
    for i in range(UNKNOWNS):
        whole[i, i] = 1.0
    eliminate(step.normal.copy(), whole)
    for i in range(8):
        for j in range(8):
            covariance[i, j] = whole[i, j] * max(step.variance, least)
    noise = math.sqrt(step.variance)
    return PatternFit(step.h, covariance, step.state, noise, step.explained, pixels, last)


@kernel
def _failed(h: Array, state: Array, noise: float, pixels: float, last: float) -> PatternFit:
    return PatternFit(h, np.zeros((8, 8)), state, noise, 0.0, pixels, last)


@kernel
def _is_wide(tag: TagImage, h: Array, blur: float) -> bool:
    """Whether a pixel near one edge of the print is too far from the next to see it."""
    half = (tag.cells.shape[0] - 2) / 2.0
    across, down = blur_at_centre(h, tag.ray_step, half, max(blur, SHARP))
    return LEAST_CELL * max(across, down) < 1.0


@kernel
def _fit_edges(tag: TagImage, h: Array, state: Array, search: Search, scale: float) -> PatternFit:
    """Gauss-Newton on the pixels along the edges, from a map within some tenths of a pixel.

    Its pixels are `TOO_NARROW` where the blur turns out too wide for the cells.
    """
    half = (tag.cells.shape[0] - 2) / 2.0
    work, stale = new_work(), False
    pixels = edge_pixels(tag, h, state[2], search.most_pixels)
    count, noise, last = 0.0, 0.0, 1e9
    for turn in range(MOST_EDGE_PASSES):
        if stale:
            pixels = edge_pixels(tag, h, state[2], search.most_pixels)
        seen = pass_over(tag, pixels, h, state, scale, work)
        count = seen.pixels
        if count < 4 * UNKNOWNS:
            return _failed(h, state, 0.0, count, last)
        blur = state[2]
        across, down = blur_at_centre(h, tag.ray_step, half, blur)
        step = _step(seen, h, state, half, search.noise, _is_least(seen, state))
        settled = _settled_at(seen, scale, step.scale, turn == MOST_EDGE_PASSES - 1)
        h, state, scale, noise = step.h, step.state, step.scale, math.sqrt(step.variance)
        blurs = step.size * half / min(across, down)
        last = max(step.size, 0.5 * step.blur_step)
        if blurs < settled and step.blur_step < EDGE_SETTLED:
            return _given(step, search.noise * search.noise, count, last)
        stale = blurs > EDGE_LOST or step.blur_step > EDGE_LOST
        if not _is_wide(tag, h, state[2]):
            return _failed(h, state, noise, TOO_NARROW, last)
    return _failed(h, state, noise, count, last)


@kernel
def fit_pattern(tag: TagImage, pattern_from_ray: Array, search: Search) -> PatternFit:
    """Gauss-Newton from coarse to fine, from a first guess of the pattern's map (3, 3)."""
    h = pattern_from_ray.copy()
    half = (tag.cells.shape[0] - 2) / 2.0
    blurs, guess = search.blurs, search.guess
    state = np.empty(3)
    state[0], state[1], state[2] = FIRST_BLACK, FIRST_CONTRAST, blurs[0]
    arrays = new_arrays()
    fine, coarse = _strides(tag.box, search.most_pixels)
    scale, predicted = ANY_RESIDUAL, guess[1] > 0.0
    narrow = False
    if predicted:
        state[0], state[1] = guess[0], guess[1]
        scale = 2.0 * guess[2] + 2.0
        if _is_wide(tag, h, state[2]):
            fitted = _fit_edges(tag, h, state, search, scale)
            if fitted.pixels != TOO_NARROW:
                return fitted
            narrow = True
    held = len(blurs) - 1
    noise, pixels, last = 0.0, 0.0, 1e9
    for iteration in range(held + MOST_FREE_PASSES):
        free = iteration >= held
        if iteration <= held:
            state[2] = blurs[iteration]
        settled = free and last < SETTLING
        if settled and not narrow and _is_wide(tag, h, state[2]):
            fitted = _fit_edges(tag, h, state, search, scale)
            if fitted.pixels != TOO_NARROW:
                return fitted
            narrow = True
        at_once = predicted and iteration == 0
        stride = fine if settled or at_once or iteration > held + 3 else coarse
        if iteration == 0 and not predicted:
            state = _levels(accumulate(tag, h, state, stride, ANY_RESIDUAL, arrays), state)
        seen = accumulate(tag, h, state, stride, scale, arrays)
        if seen.pixels < 4 * UNKNOWNS:
            return _failed(h, state, 0.0, pixels, last)
        held_now = not free or _is_least(seen, state)
        step = _step(seen, h, state, half, search.noise, held_now)
        h, state, scale = step.h, step.state, step.scale
        last = max(step.size, 0.5 * step.blur_step if free else 0.0)
        noise, pixels = math.sqrt(step.variance), seen.pixels
        if free and stride == fine and last < SETTLED:
            return _given(step, search.noise * search.noise, pixels, last)
    return _failed(h, state, noise, pixels, last)
