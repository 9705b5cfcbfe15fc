"""Layouts of markers brought onto each other though one of them may be off.

A marker's place differs from run to run (it was touched, another part of it was hidden) by tenths
of a millimetre usually and by millimetres at times: a Student law, whose scale is estimated and
whose tails let the odd marker go instead of turning the whole platform with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.measured.rigid_fit import fit_rigid, is_planar_or_better
from freeswing.cdpr.rotation import skew

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Student's degrees of freedom: 4 keeps 80 % of the precision on normal errors.
FREEDOM = 4.0
ROUNDS = 40
SESSION_ROUNDS = 10
SETTLED_M = 1e-9
# Log likelihoods closer than this leave open which marker is off (odds below 20 to 1).
CLEAR = 3.0
# Scale of a marker's place from run to run where there is one run alone (Bologna: 0.2 to 0.6 mm).
RUN_STD_M = 3e-4
LEAST_STD_M = 1e-6
# target.toml from a drawing is not better than this.
TARGET_LEAST_STD_M = 2e-5
# A number in target.toml that is wrong is so by anything up to this, in one marker of twenty.
WRONG_BY_M = 0.02
WRONG_SHARE = 0.05
# With the scale estimated from three distances, chance makes odds of 20 often; of 150 in 1 %.
TARGET_CLEAR = 5.0
# Two ways to lie on a layout are different where they shift or turn the markers by more than this.
DIFFERENT_M = 1e-3


@dataclass(frozen=True, slots=True)
class Alignment:
    """A layout brought onto another.

    Attributes:
        points_m: the layout, moved, (n_m, 3).
        change_m: moved minus what it was brought onto, (n_m, 3).
        weights: of the markers, one over variance (1/m2), (n_m,).
        covariance: of the motion that remains unknown: small shift (m) and rotation vector (rad)
            in the frame of the layout, (6, 6).
        rival_m: how far the next best way to lie on it moves a marker, where that explains the
            difference as well (another marker is off); 0 where none does.
        rival_change_m: `change_m` of that way, (n_m, 3).
    """

    points_m: Array
    change_m: Array
    weights: Array
    covariance: Array
    rival_m: float
    rival_change_m: Array


def align(points: Array, onto: Array, scale_m: float, use: Array | None = None) -> Alignment | None:
    """Bring points (n_m, 3), NaN where unknown, onto a layout; None where three are not left.

    Args:
        points: what is moved.
        onto: where to, (n_m, 3).
        scale_m: of the Student law of a coordinate of a marker's difference.
        use: weight factor of each marker, 0 to leave it out, (n_m,).
    """
    known = np.asarray(np.isfinite(points).all(axis=1) & np.isfinite(onto).all(axis=1))
    factors = np.where(known, 1.0 if use is None else use, 0.0)
    if not is_planar_or_better(onto[factors > 0.0]):
        return None
    filled, there = (np.where(known[:, None], some, 0.0) for some in (points, onto))
    scale = max(scale_m, LEAST_STD_M)
    moves, weights, costs = _settled(filled, there, scale, factors, _starts(there, factors))
    return _best(moves, weights, costs, onto, known, CLEAR)


def _best(
    moves: Array, weights: Array, costs: Array, onto: Array, known: Mask, clear: float
) -> Alignment:
    """The way (k, n_m, 3) of least cost (k,), and the farthest of those that are as good."""
    best = int(np.argmin(costs))
    apart = np.linalg.norm((moves - moves[best])[:, known], axis=2).max(axis=1)
    other = int(np.argmax(np.where(costs - costs[best] < clear, apart, -1.0)))
    rival = float(apart[other])
    arms = -skew(moves[best])
    J = np.concatenate([np.broadcast_to(np.eye(3), arms.shape), arms], axis=2)
    information = np.einsum("m,mki,mkj->ij", weights[best], J, J)
    moved, moved_too = (np.where(known[:, None], moves[k], np.nan) for k in (best, other))
    return Alignment(
        moved,
        moved - onto,
        weights[best],
        np.linalg.inv(information),
        rival if rival > DIFFERENT_M else 0.0,
        moved_too - onto,
    )


@dataclass(frozen=True, slots=True)
class SessionLayout:
    """One layout for all runs, and how much a marker's place differs from it in one run.

    Attributes:
        layout_m: markers, platform frame, (n_m, 3).
        change_m: those minus target.toml's, NaN for markers never seen, (n_m, 3).
        run_std_m: scale of a coordinate of a marker's change from run to run.
        from_target: how the layout lies on target.toml's.
    """

    layout_m: Array
    change_m: Array
    run_std_m: float
    from_target: Alignment | None


def session_layout(nominal: Array, runs: Sequence[Array], noise_m: float) -> SessionLayout:
    """The layout that all runs together have, in the frame that target.toml's markers give.

    Args:
        nominal: target.toml's places, (n_m, 3).
        runs: each run's own mean layout in a frame of its own, NaN where never seen, (n_m, 3).
        noise_m: what a run's mean layout is known to; the least scale.
    """
    layout, scale = nominal, RUN_STD_M
    for count in range(SESSION_ROUNDS):
        tried = (align(r, layout, scale) if count else align_to_target(r, layout) for r in runs)
        aligned = [found for found in tried if found is not None]
        if not aligned:
            return SessionLayout(nominal, np.full_like(nominal, np.nan), scale, None)
        changes = np.array([one.change_m for one in aligned])
        weights = np.array([one.weights for one in aligned])
        total = weights.sum(axis=0)
        step = np.nansum(weights[..., None] * changes, axis=0) / np.maximum(total, 1e-300)[:, None]
        layout = layout + step
        scale = _scale(changes - step, scale, noise_m)
        if np.abs(step).max() < SETTLED_M:
            break
    seen = np.asarray(np.isfinite(np.array(runs)).any(axis=(0, 2)))
    onto = align_to_target(np.where(seen[:, None], layout, np.nan), nominal)
    if onto is None:
        return SessionLayout(nominal, np.full_like(nominal, np.nan), scale, None)
    placed = np.where(seen[:, None], onto.points_m, nominal)
    return SessionLayout(placed, onto.change_m, scale, onto)


def align_to_target(points: Array, onto: Array) -> Alignment | None:
    """Bring a measured layout onto target.toml's, whose accuracy nobody has said.

    Every marker may be the one that is wrong: each subset is fitted by least squares, and its
    likelihood, the scale profiled, weighs how well it agrees against how much it leaves out.

    Args:
        points: what is moved, NaN where unknown, (n_m, 3).
        onto: target.toml's places, (n_m, 3).
    """
    known = np.asarray(np.isfinite(points).all(axis=1))
    if not is_planar_or_better(onto[known]):
        return None
    filled = np.where(known[:, None], points, 0.0)
    starts = _starts(onto, known.astype(float))
    moves = _moved(filled, np.broadcast_to(onto, (len(starts), *onto.shape)), starts)
    squares = np.sum(starts * np.sum((moves - onto) ** 2, axis=2), axis=1)
    freedom = 3.0 * starts.sum(axis=1) - 6.0
    scales = np.maximum(np.sqrt(squares / freedom), TARGET_LEAST_STD_M)
    fits = freedom * np.log(scales * np.sqrt(2.0 * np.pi)) + 0.5 * squares / scales**2
    out = known.sum() - starts.sum(axis=1)
    costs = fits + out * (3.0 * np.log(2.0 * WRONG_BY_M) - np.log(WRONG_SHARE))
    return _best(moves, starts / scales[:, None] ** 2, costs, onto, known, TARGET_CLEAR)


def _scale(changes: Array, scale_m: float, noise_m: float) -> float:
    """Scale of the changes (n_r, n_m, 3) that are left beside one layout, NaN where unknown.

    A step of expectation and maximisation from a scale: squares by Student's weights over the
    numbers that the frames of the runs and the layout leave free. Medians of what robust fits leave
    are a third too small.

    Source:
        Lange, Little, Taylor 1989, Robust statistical modeling using the t distribution.
    """
    known: Mask = np.asarray(np.isfinite(changes).all(axis=2))
    squares = np.sum(np.where(known[..., None], changes, 0.0) ** 2, axis=2)
    freedom = 3 * known.sum() - 6 * known.any(axis=1).sum() - 3 * known.any(axis=0).sum() + 6
    if freedom < 6:
        return RUN_STD_M
    weights = (FREEDOM + 3.0) / (FREEDOM + squares / scale_m**2)
    return max(float(np.sqrt(np.sum(weights * squares) / freedom)), noise_m, LEAST_STD_M)


def _starts(onto: Array, factors: Array) -> Array:
    """Weights of all markers, and of all without one where that fixes an orientation, (k, n_m)."""
    used = factors > 0.0
    starts = [used]
    for k in np.flatnonzero(used):
        rest = used.copy()
        rest[k] = False
        if is_planar_or_better(onto[rest]):
            starts.append(rest)
    return np.array(starts, dtype=float)


def _settled(
    points: Array, onto: Array, scale: float, factors: Array, weights: Array
) -> tuple[Array, Array, Array]:
    """Points moved (k, n_m, 3), weights (k, n_m) and costs (k,) of the fits from k starts."""
    goal = np.broadcast_to(onto, (len(weights), *onto.shape))
    moved, squares = np.broadcast_to(points, goal.shape), np.zeros(goal.shape[:2])
    for _ in range(ROUNDS):
        before, moved = moved, _moved(points, goal, weights)
        squares = np.sum((moved - onto) ** 2, axis=2) / scale**2
        weights = factors * (FREEDOM + 3.0) / (FREEDOM + squares)
        if np.abs(moved - before).max() < SETTLED_M:
            break
    each = 0.5 * (FREEDOM + 3.0) * np.log1p(squares / FREEDOM)
    return moved, weights / scale**2, np.sum(factors * each, axis=1)


def _moved(points: Array, goal: Array, weights: Array) -> Array:
    R, t = fit_rigid(points, goal, weights)
    return points @ R.swapaxes(1, 2) + t[:, None]
