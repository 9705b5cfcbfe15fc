"""Samples as they come, onto one regular grid: dropped frames, jitter, short gaps, jumps.

Nothing is invented: a gap longer than the stated length stays missing, and a bridged sample
carries the weights of the samples it was made of, so that its noise can be propagated exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.robot import Array

_BRIDGE_SIDE = 4  # samples on either side that a bridged one is made of
_BRIDGE_DEGREE = 3
_JUMP_SIDE = 8
_JUMP_DEGREE = 3


@dataclass(frozen=True, slots=True)
class Grid:
    """Samples on regular times; NaN rows are missing.

    Attributes:
        times_s: (n,), regular.
        values: (n, n_c).
        source: index of the original sample, -1 where there is none, (n,).
        period_s: sampling period.
        jitter_s: the largest distance of a sample from its place on the grid.
    """

    times_s: Array
    values: Array
    source: NDArray[np.int64]
    period_s: float
    jitter_s: float


def regular_grid(times_s: Array, values: Array) -> Grid:
    """Places samples on a regular grid, moved there along their local slope where they jitter.

    Args:
        times_s: (n,), increasing; frames may be absent.
        values: (n, n_c); a row with any NaN counts as missing.

    Raises:
        ValueError: with fewer than 8 samples, or times that do not increase.
    """
    if len(times_s) < 8:
        raise ValueError(f"{len(times_s)} samples, at least 8 are needed")
    steps = np.diff(times_s)
    if not np.all(steps > 0.0):
        first = int(np.argmin(steps))
        raise ValueError(f"times do not increase at {times_s[first]:.6g} s: sort the samples")
    period = float(np.median(steps))
    index = np.concatenate([[0], np.cumsum(np.maximum(1, np.round(steps / period)))]).astype(int)
    slope, start = np.polyfit(index, times_s, 1)
    grid_times = start + slope * np.arange(index[-1] + 1)
    offset = np.asarray(grid_times[index] - times_s, dtype=np.float64)
    moved = values
    if np.abs(offset).max() > 1e-3 * slope:
        moved = values + offset[:, None] * np.gradient(values, times_s, axis=0)
    gridded = np.full((len(grid_times), values.shape[1]), np.nan)
    gridded[index] = np.where(np.isnan(moved).any(axis=1, keepdims=True), np.nan, moved)
    source = np.full(len(grid_times), -1)
    source[index] = np.arange(len(times_s))
    return Grid(grid_times, gridded, source, float(slope), float(np.abs(offset).max()))


@dataclass(frozen=True, slots=True)
class Bridge:
    """A missing sample made of its neighbours.

    Attributes:
        index: the sample.
        donors: samples it is made of.
        weights: their weights.
    """

    index: int
    donors: NDArray[np.int64]
    weights: Array


def gaps(missing: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Start and end (exclusive) of every stretch of missing samples."""
    edges = np.diff(np.concatenate([[0], missing.astype(int), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return list(zip(starts.tolist(), ends.tolist(), strict=True))


def bridges(missing: NDArray[np.bool_], longest: int) -> list[Bridge]:
    """Cubic bridges over gaps of at most `longest` samples that have neighbours on both sides."""
    present = np.flatnonzero(~missing)
    made: list[Bridge] = []
    for start, end in gaps(missing):
        before = present[present < start][-_BRIDGE_SIDE:]
        after = present[present >= end][:_BRIDGE_SIDE]
        if end - start > longest or len(before) < 2 or len(after) < 2:
            continue
        donors = np.concatenate([before, after])
        centre = 0.5 * (start + end - 1)
        powers = np.arange(_BRIDGE_DEGREE + 1)
        fit = np.linalg.pinv((donors[:, None] - centre) ** powers)
        for index in range(start, end):
            made.append(Bridge(index, donors, (index - centre) ** powers @ fit))
    return made


def incomplete(values: Array) -> NDArray[np.bool_]:
    """True where a sample misses a coordinate, (n,)."""
    return np.asarray(np.isnan(values).any(axis=1))


def bridged(values: Array, made: list[Bridge]) -> Array:
    """`values` with the bridges filled in, (n, n_c).

    Source:
        Press et al. 2007, Numerical Recipes, sec. 3.2: polynomials through neighbours, as
        weights.
    """
    filled = values.copy()
    for bridge in made:
        filled[bridge.index] = bridge.weights @ values[bridge.donors]
    return filled


def jump_sizes(values: Array) -> tuple[Array, float]:
    """How far the samples after each instant lie from those before it, extrapolated to meet.

    Returns:
        sizes: (n, n_c), row i for the step from sample i - 1 to i; NaN within eight samples of
            either end or of a missing sample.
        gain: standard deviation of a size over that of one white sample.

    Source:
        Savitzky, Golay 1964, Smoothing and Differentiation of Data by Simplified Least
        Squares, at the ends of two windows.
    """
    reach = np.arange(_JUMP_SIDE) + 0.5
    weights = np.linalg.pinv(reach[:, None] ** np.arange(_JUMP_DEGREE + 1))[0]
    sizes = np.full(values.shape, np.nan)
    if len(values) > 2 * _JUMP_SIDE:
        windows = np.lib.stride_tricks.sliding_window_view(values, _JUMP_SIDE, axis=0)
        ends = windows @ weights
        starts = windows @ weights[::-1]
        sizes[_JUMP_SIDE : len(values) - _JUMP_SIDE + 1] = (
            ends[_JUMP_SIDE:] - starts[: len(values) - 2 * _JUMP_SIDE + 1]
        )
    return sizes, float(np.sqrt(2.0 * weights @ weights))


def white_noise_std(values: Array, orders: int = 6) -> Array:
    """Robust standard deviation of white noise from high-order differences, (n_c,).

    A swing of up to a few hertz vanishes in the sixth difference of samples at 50 Hz and more;
    the median keeps steps and spikes out. NaN where fewer than 20 differences are available.

    Source:
        Hall, Kay, Titterington 1990, Difference-based estimation of variance.
    """
    gain = np.linalg.norm(np.polynomial.polynomial.polypow([1.0, -1.0], orders))
    differences = np.diff(values, orders, axis=0)
    kept = differences[np.isfinite(differences).all(axis=1)]
    if len(kept) < 20:
        return np.full(values.shape[1], np.nan)
    return 1.4826 * np.median(np.abs(kept), axis=0) / gain
