"""Two cameras beside each other, by the platform alone: when and where they saw it.

Each camera follows the platform on its own. How fast it moves and turns does not depend on who
looks, so one camera's speeds are slid over the other's through the whole record; and the platform
being one rigid body, all poses of one camera follow from the other's by one and the same motion,
`T_first_second`, at the right lag and at no other. Neither step asks where the cameras are supposed
to be, so their calibration can be held against it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.rotation import log_rotation, nearest_rotation, transform

Array = NDArray[np.float64]

MOST_LAG_S = 10.0  # people start several cameras by hand within that
LEAST_OVERLAP_S = 1.0  # less than a swing is no motion to compare
OVERLAP_SHARE = 0.5
"""Recordings of one run share at least so much of the shorter one: on less, a swing that nearly
repeats itself fits itself by chance."""
_LEAST_OVERLAP = 20  # frames: fewer speeds correlate by 0.5 by chance once in forty lags
_STEPS_A_FRAME = 2
_NEARLY_BEST = 0.25
"""Lags whose speeds correlate worse than the best by more are not looked at by poses."""
_MOST_CANDIDATES = 100
_MOST_REFINED = 12
# Cameras that were knocked by less than this leave the choice of the lag to their calibration.
_PLAUSIBLE = 3.0
_PLAUSIBLE_M = 0.02
_HALVINGS = 7
_LEVER_M = 0.2
"""A turn counts as it moves a point so far from the platform's origin."""
_LEVERS = _LEVER_M * np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])


@dataclass(frozen=True, slots=True)
class OwnTrack:
    """The platform as one camera alone saw it.

    Attributes:
        times_s: by the camera's clock as it stands, rising, (n,).
        rotations: R_camera_platform, (n, 3, 3).
        positions_m: (n, 3).
    """

    times_s: Array
    rotations: Array
    positions_m: Array

    @property
    def step_s(self) -> float:
        """The usual time from one frame to the next."""
        return float(np.median(np.diff(self.times_s)))


@dataclass(frozen=True, slots=True)
class Pair:
    """Second camera beside the first.

    Attributes:
        lag_s: to be added to the second's times.
        T_first_second: the second camera in the first's frame, as the platform says, (4, 4).
        miss_m: median distance of points about the platform after that, in metres.
        known_m: the same with the cameras where their calibration has them.
        decided_m: of the two, the one that decided between lags.
        at_zero_m: that measure without a lag, infinite where the records then do not overlap.
        at_zero_sigmas: by how many deviations poses fit worse without a lag, frame by frame, with
            the cameras as calibrated or by the platform alone: whichever tells more.
        rivals: other lags and that measure there, best first.
    """

    lag_s: float
    T_first_second: Array
    miss_m: float
    known_m: float
    decided_m: float
    at_zero_m: float
    at_zero_sigmas: float
    rivals: tuple[tuple[float, float], ...]


def pair_of(first: OwnTrack, second: OwnTrack, T_known: Array) -> Pair | None:
    """Finds lag and relative place of two cameras; None when they share too little motion.

    Args:
        first: one camera's track.
        second: the other's.
        T_known: the second camera in the first's frame by their calibration, (4, 4): where it can
            be right it decides between lags, else the platform's motion alone does.
    """
    if min(len(first.times_s), len(second.times_s)) < _LEAST_OVERLAP:
        return None
    step = min(first.step_s, second.step_s)
    lags, scores = _correlations(_speeds(first), _speeds(second), step)
    if not len(lags):
        return None
    zero = _fitted(first, second, 0.0, T_known)
    tried = [_fitted(first, second, lag, T_known) for lag in _candidates(lags, scores)]
    found = [fit for fit in (zero, *tried) if fit is not None]
    if not found:
        return None
    best_free, best_known = min(f.miss_m for f in found), min(f.known_m for f in found)
    by_known = _is_plausible(best_known, best_free)

    def size(fit: Fitted) -> float:
        return fit.known_m if by_known else fit.miss_m

    def refined(fit: Fitted) -> Fitted:
        width = step / _STEPS_A_FRAME
        for _ in range(_HALVINGS):
            width *= 0.6
            near = [_fitted(first, second, fit.lag_s + s, T_known) for s in (-width, width)]
            fit = min([fit, *(f for f in near if f is not None)], key=size)
        return fit

    near_best = sorted(found, key=size)[:_MOST_REFINED]
    tried = sorted((refined(fit) for fit in near_best), key=size)
    best = tried[0]
    rivals: list[tuple[float, float]] = []
    for fit in tried[1:]:
        taken = (best.lag_s, *(lag for lag, _ in rivals))
        if all(abs(fit.lag_s - lag) > 2.0 * step for lag in taken):
            rivals.append((fit.lag_s, size(fit)))
    at_zero = float("inf") if zero is None else size(zero)
    sigmas = float("inf") if zero is None else _worse(zero, best)
    parts = best.lag_s, best.T_first_second, best.miss_m, best.known_m
    return Pair(*parts, size(best), at_zero, sigmas, tuple(rivals))


def _worse(one: Fitted, best: Fitted) -> float:
    """By how many deviations a lag leaves poses farther apart than the best."""
    both = (one.misses_m > 0.0).all(axis=0) & (best.misses_m > 0.0).all(axis=0)
    if both.sum() < _LEAST_OVERLAP:
        return float("inf")
    return max(
        sigmas_more(theirs[both] ** 2, own[both] ** 2)
        for theirs, own in zip(one.misses_m, best.misses_m, strict=True)
    )


def sigmas_more(theirs: Array, own: Array) -> float:
    """By how many deviations squares (n,) exceed others (n,), pair by pair.

    Each difference is taken of the sum of its two, so that one by far larger than others speaks
    for being larger, and not for scatter.

    Source:
        Press et al. 2007, Numerical Recipes, sec. 14.2: means of paired samples.
    """
    more = (theirs - own) / np.maximum(theirs + own, 1e-300)
    return float(more.mean() / max(float(more.std(ddof=1)), 1e-300) * np.sqrt(len(more)))


def _speeds(track: OwnTrack) -> tuple[Array, Array]:
    """Times midway between neighbouring frames, and speed and turning rate there, (n, 2)."""
    dt = np.diff(track.times_s)
    turns = track.rotations[1:] @ np.swapaxes(track.rotations[:-1], 1, 2)
    way = np.linalg.norm(np.diff(track.positions_m, axis=0), axis=1)
    rates = np.stack([way, np.linalg.norm(log_rotation(turns), axis=1)], axis=1) / dt[:, None]
    near = dt < 2.5 * track.step_s
    return (track.times_s[1:] - 0.5 * dt)[near], _calm(rates)[near]


def _calm(rates: Array) -> Array:
    """The median of three neighbours: a single camera's depth jumps now and then."""
    padded = np.concatenate([rates[:1], rates, rates[-1:]])
    return np.median(np.stack([padded[:-2], padded[1:-1], padded[2:]]), axis=0)


def _is_plausible(known_m: float, free_m: float) -> bool:
    """Whether cameras stand as calibrated, by how far they miss so and freed of it."""
    return known_m < _PLAUSIBLE * free_m + _PLAUSIBLE_M


def _correlations(
    first: tuple[Array, Array], second: tuple[Array, Array], step: float
) -> tuple[Array, Array]:
    """Lags of enough overlap and how well the speeds then correlate."""
    lags, scores = [], []
    count = int(MOST_LAG_S / step * _STEPS_A_FRAME)
    for lag in np.arange(-count, count + 1) * step / _STEPS_A_FRAME:
        at = second[0] + lag
        inside = (at > first[0][0]) & (at < first[0][-1])
        if inside.sum() < _LEAST_OVERLAP or np.ptp(at[inside]) < LEAST_OVERLAP_S:
            continue
        parts = []
        for k in range(2):
            a = np.interp(at[inside], first[0], first[1][:, k])
            b = second[1][inside, k]
            a, b = a - a.mean(), b - b.mean()
            parts.append(float(a @ b) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-12))
        lags.append(float(lag))
        scores.append(float(np.mean(parts)))
    return np.array(lags), np.array(scores)


def _candidates(lags: Array, scores: Array) -> Array:
    """Peaks of the correlation that come near the highest, best first."""
    padded = np.concatenate([[-np.inf], scores, [-np.inf]])
    peak = (scores >= padded[:-2]) & (scores >= padded[2:])
    peak &= scores > scores.max() - _NEARLY_BEST
    order = np.argsort(-scores[peak], kind="stable")
    return lags[peak][order][:_MOST_CANDIDATES]


@dataclass(frozen=True, slots=True)
class Fitted:
    """Two tracks at one lag.

    Attributes:
        lag_s: to be added to the second's times.
        miss_m: what the motion between the cameras leaves, the median.
        known_m: what the known motion leaves.
        T_first_second: the motion between the cameras, (4, 4).
        misses_m: both for each of the second's frames, zero where not compared, (2, n).
    """

    lag_s: float
    miss_m: float
    known_m: float
    T_first_second: Array
    misses_m: Array


def _fitted(first: OwnTrack, second: OwnTrack, lag: float, T_known: Array) -> Fitted | None:
    """The one motion that carries the second camera's poses onto the first's."""
    at = second.times_s + lag
    times = first.times_s
    right = np.searchsorted(times, at)
    shared = (right > 1) & (right < len(times) - 1)
    four = np.clip(right, 2, len(times) - 2)[:, None] + np.arange(-2, 2)
    inside = shared & (np.diff(times[four], axis=1).max(axis=1) < 1.5 * first.step_s)
    # frames beside a gap are compared by nobody, but both recorded them
    apart = shared.sum() < OVERLAP_SHARE * min(len(at), len(times))
    if apart or inside.sum() < _LEAST_OVERLAP or np.ptp(at[inside]) < LEAST_OVERLAP_S:
        return None
    four, own = four[inside], _points(second)[inside]
    weights = _cubic(times[four], at[inside])
    seen = np.einsum("nk,nkpa->npa", weights, _points(first)[four])
    miss = _misses(_onto(own, seen), own, seen)
    good = miss <= 2.0 * np.median(miss)
    T = _onto(own[good], seen[good])
    misses = np.zeros((2, len(at)))
    misses[:, inside] = _misses(T, own, seen), _misses(T_known, own, seen)
    miss_m, known_m = np.median(misses[:, inside], axis=1)
    return Fitted(lag, float(miss_m), float(known_m), T, misses)


def _cubic(times: Array, at: Array) -> Array:
    """Weights of the cubic through samples at four times (n, 4), read at (n,)."""
    weights = np.ones_like(times)
    for i in range(4):
        for j in range(4):
            if i != j:
                weights[:, i] *= (at - times[:, j]) / (times[:, i] - times[:, j])
    return weights


def _misses(T: Array, own: Array, seen: Array) -> Array:
    """Mean distance of the moved points from those seen, (n,)."""
    return np.linalg.norm(own @ T[:3, :3].T + T[:3, 3] - seen, axis=2).mean(axis=1)


def _points(track: OwnTrack) -> Array:
    """Points about the platform in the camera's frame, (n, 7, 3)."""
    return _LEVERS @ np.swapaxes(track.rotations, 1, 2) + track.positions_m[:, None]


def _onto(points: Array, aim: Array) -> Array:
    """The motion that brings points nearest to others, both (n, 7, 3).

    Seven points about each instant's platform never lie on a line, none is missing: the rotation of
    Kabsch 1976 stands without the checks of `cdpr.measured.rigid_fit`.
    """
    points, aim = points.reshape(-1, 3), aim.reshape(-1, 3)
    middle, goal = points.mean(axis=0), aim.mean(axis=0)
    turn = nearest_rotation((points - middle).T @ (aim - goal)).T
    return transform(turn, goal - turn @ middle)
