"""How rigid the markers of one run are, each by itself, and which one spoils it.

The residual of a rigid fit with equal weights is P e with P constant in the platform frame, so its
mean squares are a linear function of the markers' variances: E|r_m|^2 = sum_n |P_mn|^2 v_n. Solved
for v this says which marker lies, without iterating and without favouring one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.measured.rigid_fit import fit_rigid, is_planar_or_better
from freeswing.cdpr.rotation import skew

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# A marker is left out where the others agree twice as well without it (Bologna: 2.1 to 5.2 times
# in the 15 runs that one marker spoils, at most 1.5 in the 18 that none does).
SPOILS = 2.0
# ... and where what it adds is more than motion capture's own noise is worth.
LEAST_SPOILT_M = 2e-5
FEWEST_KEPT = 3
# No marker is trusted more than this much above the typical one: few markers cannot prove it.
LEAST_VARIANCE_SHARE = 0.25
LEAST_STD_M = 1e-9
# Frames to compare subsets of markers on, a deviation to 3 %; and to take mean places from.
ENOUGH_TO_COMPARE = 300
ENOUGH_FOR_LAYOUT = 800
ROUNDS = 30
SETTLED_M = 1e-8


@dataclass(frozen=True, slots=True)
class Rigidity:
    """What one run's markers are worth.

    Attributes:
        layout_m: their mean places in a platform frame of the run's own, NaN where never seen.
        std_m: standard deviation of each marker's coordinates about that layout, (n_m,).
        left_out: indices of markers that spoil the run.
        all_m: standard deviation of a coordinate with every marker used alike.
        kept_m: the same of those that are kept.
        residuals_m: measured minus fitted, base frame, NaN where missing, (n_t, n_m, 3).
    """

    layout_m: Array
    std_m: Array
    left_out: tuple[int, ...]
    all_m: float
    kept_m: float
    residuals_m: Array


def rigidity(nominal: Array, points: Array) -> Rigidity:
    """Examine the markers of one run.

    Args:
        nominal: rough layout, (n_m, 3).
        points: (n_t, n_m, 3), NaN where missing.
    """
    use = np.asarray(np.isfinite(points).all(axis=2).any(axis=0))
    some = points[_some_frames(len(points), ENOUGH_TO_COMPARE)]
    many = points[_some_frames(len(points), ENOUGH_FOR_LAYOUT)]
    first = level = _level(nominal, some, use)
    out: list[int] = []
    while use.sum() > FEWEST_KEPT:
        k, without = _best_without(nominal, some, use)
        excess = np.sqrt(max(level**2 - without**2, 0.0))
        if k < 0 or level < SPOILS * without or excess < LEAST_SPOILT_M:
            break
        out.append(k)
        use[k], level = False, without
    layout = mean_layout(nominal, many, use.astype(float))
    residuals = _residuals(layout, points, use.astype(float))
    std = _own_deviations(layout, residuals, use)
    weights = marker_weights(std, tuple(out))
    layout = mean_layout(layout, many, weights)
    residuals = _residuals(layout, points, weights)
    return Rigidity(layout, std, tuple(out), first, level, residuals)


def _some_frames(n: int, most: int) -> NDArray[np.intp]:
    """At most `most` of n frames, spread evenly but in no step that a marker could blink in."""
    if n <= most:
        return np.arange(n)
    golden = np.arange(most) * (np.sqrt(5.0) - 1.0) / 2.0
    return np.unique((n * (golden % 1.0)).astype(np.intp))


def marker_weights(std: Array, left_out: tuple[int, ...]) -> Array:
    """One over each marker's variance, 0 for those left out or never seen, (n_m,).

    Source:
        Press et al. 2007, Numerical Recipes, sec. 15.1: weights of least squares.
    """
    weights = np.where(np.isfinite(std), 1.0 / np.maximum(std, LEAST_STD_M) ** 2, 0.0)
    weights[list(left_out)] = 0.0
    return weights


def mean_layout(nominal: Array, points: Array, weights: Array) -> Array:
    """Mean places of all markers in the frame of the weighted ones, NaN where never seen, (n_m, 3).

    Its frame is that of the nominal layout as the weighted markers give it.

    Source:
        Gower 1975, Generalized Procrustes Analysis.
    """
    layout = np.where(np.isfinite(nominal), nominal, 0.0)
    for _ in range(ROUNDS):
        R, t = fit_rigid(layout, points, weights[None])
        body = np.einsum("tij,tmi->tmj", R, points - t[:, None, :])
        seen = np.isfinite(body).all(axis=2)
        counts = seen.sum(axis=0)
        sums = np.where(seen[:, :, None], body, 0.0).sum(axis=0)
        means = np.where(counts[:, None] > 0, sums / np.maximum(counts, 1)[:, None], layout)
        turn, shift = fit_rigid(means, layout[None], (weights * (counts > 0))[None])
        if not np.isfinite(shift).all():
            break
        moved = means @ turn[0].T + shift[0]
        step = float(np.abs(moved - layout).max())
        layout = moved
        if step < SETTLED_M:
            break
    seen = np.asarray(np.isfinite(points).all(axis=2).any(axis=0))
    return np.where(seen[:, None], layout, np.nan)


def _residuals(layout: Array, points: Array, weights: Array) -> Array:
    known = np.where(np.isfinite(layout), layout, 0.0)
    R, t = fit_rigid(known, points, weights[None])
    return points - np.einsum("tij,mj->tmi", R, known) - t[:, None, :]


def _level(nominal: Array, points: Array, use: Mask) -> float:
    """Standard deviation of a coordinate of the used markers about their own mean layout."""
    weights = use.astype(float)
    layout = mean_layout(nominal, points, weights)
    residuals = _residuals(layout, points, weights)[:, use]
    seen = np.asarray(np.isfinite(residuals).all(axis=2))
    determined = seen.sum(axis=1) >= FEWEST_KEPT
    freedom = (
        3 * int(seen[determined].sum()) - 6 * int(determined.sum()) - max(3 * int(use.sum()) - 6, 0)
    )
    squares = np.nansum(residuals[determined] ** 2)
    return float(np.sqrt(squares / freedom)) if freedom > 0 else float("nan")


def _best_without(nominal: Array, points: Array, use: Mask) -> tuple[int, float]:
    """The marker without which the others agree best, and how well; -1 where none can go."""
    best, lowest = -1, float("inf")
    for k in np.flatnonzero(use):
        rest = use.copy()
        rest[k] = False
        if is_planar_or_better(nominal[rest]):
            level = _level(nominal, points, rest)
            if level < lowest:
                best, lowest = int(k), level
    return best, lowest


def _own_deviations(layout: Array, residuals: Array, use: Mask) -> Array:
    """Each marker's standard deviation from residuals of equal weights over the used ones, (n_m,).

    Markers that are not used get their residual against the others, less what those add.
    """
    seen = np.asarray(np.isfinite(residuals).all(axis=2))
    patterns, which = np.unique(seen, axis=0, return_inverse=True)
    n = residuals.shape[1]
    mixing, squares = np.zeros((n, n)), np.zeros(n)
    for k, pattern in enumerate(patterns):
        if not is_planar_or_better(layout[pattern & use]):
            continue
        chosen = which.reshape(-1) == k
        mixing += chosen.sum() * _mixing(layout, pattern, use)
        squares += np.nansum(residuals[chosen] ** 2, axis=(0, 2))
    known = np.diag(mixing) > 0.0
    result = np.full(n, np.nan)
    inner = known & use
    if inner.sum() <= FEWEST_KEPT:  # three distances do not tell three markers apart
        result[inner] = np.sqrt(
            squares[inner].sum() / max(mixing[np.ix_(inner, inner)].sum(), 1e-300)
        )
    else:
        variances = np.linalg.solve(mixing[np.ix_(inner, inner)], squares[inner])
        floor = LEAST_VARIANCE_SHARE * float(np.median(np.maximum(variances, 0.0)))
        result[inner] = np.sqrt(np.maximum(variances, floor))
    for k in np.flatnonzero(known & ~use):
        rest = squares[k] - mixing[k, inner] @ result[inner] ** 2
        result[k] = np.sqrt(max(rest, 0.0) / mixing[k, k])
    return result


def _mixing(layout: Array, pattern: Mask, use: Mask) -> Array:
    """|P_mn|^2 of residuals r = P e by the variances of e, 0 outside of the pattern, (n_m, n_m)."""
    n = len(layout)
    inner = pattern & use
    places = np.where(np.isfinite(layout), layout, 0.0)
    J = np.concatenate([np.broadcast_to(np.eye(3), (n, 3, 3)), -skew(places)], axis=2)
    information = np.einsum("mki,mkj->ij", J[inner], J[inner])
    H = np.einsum("mki,ij,nlj->mknl", J, np.linalg.inv(information), J)
    H[:, :, ~inner] = 0.0
    P = np.einsum("mn,kl->mknl", np.eye(n), np.eye(3)) - H
    squared = np.einsum("mknl,mknl->mn", P, P)
    return squared * pattern[:, None] * pattern[None, :]
