"""Samples that were made of others: copies of the one before, and points between two.

A capture that misses a frame writes the last one again, an export at a higher rate draws lines from
sample to sample. Both look like motion to a fit: a copy lags by a whole step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.measured.trajectory import Trajectory

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Copies that chance makes, by how fine numbers are: where it makes more, none is called a copy.
# Two coordinates of some hundred samples are never so sure, six are a million times.
MOST_BY_CHANCE = 1e-4
# Off the line between its neighbours by less than this of what others are off: angles of turns
# that were drawn by quaternions are off by up to 0.14. Of 6 noisy coordinates one sample in 20,000
# is so.
ON_THE_LINE = 0.15
# Half of a doubled rate lies on lines, less where rows were dropped.
INTERPOLATED_SHARE = 0.35
LEAST_SAMPLES = 20
RAISED = (2, 3, 4, 5)
# Where no row was dropped a few in a hundred lie on lines by chance, or beside them; else half.
PATTERN_SHARE = 0.9


def off_the_line(values: Array, times_s: Array) -> tuple[Array, Array]:
    """How far samples lie from the line through their neighbours, (n_t - 2, n_c).

    Also, by sample, how much of that line is the sample after, (n_t - 2,).

    Source:
        Press et al. 2007, Numerical Recipes, sec. 3.1: linear interpolation.
    """
    share = (times_s[1:-1] - times_s[:-2]) / (times_s[2:] - times_s[:-2])
    after = share[:, None]
    return values[1:-1] - after * values[2:] - (1.0 - after) * values[:-2], share


def repeated(values: Array) -> Mask:
    """Samples that equal the one before in all coordinates, where chance makes none, (n_t,).

    Args:
        values: coordinates, missing ones NaN, (n_t, n_c).
    """
    steps = np.abs(np.diff(values, axis=0))
    same = np.asarray((steps == 0.0).all(axis=1))
    by_chance = float(len(values))
    for column in steps[np.isfinite(steps).all(axis=1)].T:
        moved = column[column > 0.0]
        # The least step is that of the print or above it, so that chance is not underrated.
        by_chance *= float(moved.min() / np.median(moved)) if len(moved) else 1.0
    if by_chance > MOST_BY_CHANCE:
        same[:] = False
    return np.concatenate([[False], same])


def interpolated(trajectory: Trajectory) -> Mask | None:
    """Samples on the line between their neighbours, (n_t,); None where the rate was not raised."""
    values, times_s = trajectory.values, trajectory.times_s
    if len(values) < LEAST_SAMPLES:
        return None
    off = np.abs(off_the_line(values, times_s)[0])
    known = np.isfinite(off).all(axis=1)
    moves = known & (np.diff(values, axis=0)[:-1] != 0.0).any(axis=1)
    if moves.sum() < LEAST_SAMPLES:
        return None
    # Of a rate that was raised five times a fifth of the samples are measured.
    usual = np.percentile(off[moves], 90.0, axis=0)
    on = moves & (off <= ON_THE_LINE * usual).all(axis=1)
    if on.sum() < INTERPOLATED_SHARE * moves.sum():
        return None
    flagged = np.concatenate([[False], on, [False]])
    return _every_so_many(flagged, np.concatenate([[False], moves, [False]]))


def _every_so_many(flagged: Mask, moves: Mask) -> Mask:
    """All but every second, third, .. sample where that is what was flagged, else what was."""
    index = np.arange(len(flagged))
    patterns = [index % raised != first for raised in RAISED for first in range(raised)]
    alike = [float(np.mean(flagged[moves] == pattern[moves])) for pattern in patterns]
    best = int(np.argmax(alike))
    return patterns[best] if alike[best] > PATTERN_SHARE else flagged
