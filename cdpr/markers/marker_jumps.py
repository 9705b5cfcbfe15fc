"""A marker that jumps is left out where it did; exchanged labels are put right before."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.markers.distances import distances, medians, pairs_of
from freeswing.cdpr.markers.exchanged_labels import Exchange, exchanged_for_some_frames

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Pairs = NDArray[np.intp]

# A marker that jumps by more than this in one frame is not where it was: noise of motion capture
# is 0.02 to 0.2 mm, and a half-hidden marker's centroid drifts over many frames.
JUMP_M = 1e-3
# Normal noise reaches eight of its own deviations once in 1e15 samples.
JUMP_DEVIATIONS = 8.0
NORMAL_BY_MAD = 1.4826


@dataclass(frozen=True, slots=True)
class Jump:
    """A marker away from its place for some frames, and how far at most."""

    marker: int
    frames: NDArray[np.intp]
    most_m: float


@dataclass(frozen=True, slots=True)
class Mended:
    """Marker positions (n_t, n_m, 3) with gross faults put right or left out, and which."""

    positions_m: Array
    exchanges: tuple[Exchange, ...] = ()
    jumps: tuple[Jump, ...] = ()

    def within(self, inside: Mask) -> Mended:
        """The same positions with the faults of some samples (n_t,) alone."""
        exchanges = (Exchange(e.markers, e.frames[inside[e.frames]]) for e in self.exchanges)
        jumps = (Jump(j.marker, j.frames[inside[j.frames]], j.most_m) for j in self.jumps)
        return Mended(
            self.positions_m,
            tuple(e for e in exchanges if len(e.frames)),
            tuple(j for j in jumps if len(j.frames)),
        )


def mended(points: Array) -> Mended:
    """Labels exchanged for some frames put right, and markers that jump left out of those frames.

    Args:
        points: (n_t, n_m, 3), NaN where missing.
    """
    pairs = pairs_of(points.shape[1])
    if len(pairs) < 3:
        return Mended(points)
    apart = distances(points, pairs)
    usual = medians(apart)
    spread = NORMAL_BY_MAD * medians(np.abs(apart - usual))
    limits = np.maximum(JUMP_DEVIATIONS * spread, JUMP_M)
    wrong = np.abs(apart - usual) > limits
    bad = np.flatnonzero(wrong.any(axis=1))
    if not len(bad):
        return Mended(points)
    result = points.copy()
    exchanges = exchanged_for_some_frames(result, bad, pairs, usual, limits)
    put_right = np.concatenate([e.frames for e in exchanges]) if exchanges else bad[:0]
    jumps = _left_out(result, np.setdiff1d(bad, put_right), pairs, usual, limits)
    return Mended(result, exchanges, jumps)


def _left_out(
    points: Array, bad: Pairs, pairs: Pairs, usual: Array, limits: Array
) -> tuple[Jump, ...]:
    """Leave out, in place, the marker that most distances accuse until none is left."""
    n = points.shape[1]
    frames: list[list[int]] = [[] for _ in range(n)]
    most = np.zeros(n)
    while len(bad):
        off = np.nan_to_num(np.abs(distances(points[bad], pairs) - usual))
        wrong = off > limits
        accused = np.zeros((len(bad), n))
        for k, pair in enumerate(pairs):
            accused[:, pair] += (wrong[:, k] * (1.0 + 1e-3 * np.tanh(off[:, k])))[:, None]
        worst = accused.argmax(axis=1)
        for marker in np.unique(worst):
            mine = worst == marker
            frames[marker] += bad[mine].tolist()
            most[marker] = max(most[marker], off[mine][:, (pairs == marker).any(axis=1)].max())
        points[bad, worst] = np.nan
        with np.errstate(invalid="ignore"):
            still = (np.abs(distances(points[bad], pairs) - usual) > limits).any(axis=1)
        bad = bad[still]
    return tuple(
        Jump(k, np.array(sorted(frames[k]), dtype=np.intp), float(most[k]))
        for k in range(n)
        if frames[k]
    )
