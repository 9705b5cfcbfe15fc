"""Layouts of markers brought onto each other though one of them may be off.

A marker's place differs from run to run (it was touched, another part of it was hidden) by tenths
of a millimetre usually and by millimetres at times: a Student law, whose scale is estimated and
whose tails let the odd marker go instead of turning the whole platform with it.
"""

from __future__ import annotations

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
SETTLED_M = 1e-9
# Log likelihoods closer than this leave open which marker is off (odds below 20 to 1).
CLEAR = 3.0
LEAST_STD_M = 1e-6
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
    moves, weights, costs = _settled(filled, there, scale, factors, without_one(there, factors))
    return best_way(moves, weights, costs, onto, known, CLEAR)


def best_way(
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


def without_one(onto: Array, factors: Array) -> Array:
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
        before, moved = moved, rigidly_moved(points, goal, weights)
        squares = np.sum((moved - onto) ** 2, axis=2) / scale**2
        weights = factors * (FREEDOM + 3.0) / (FREEDOM + squares)
        if np.abs(moved - before).max() < SETTLED_M:
            break
    each = 0.5 * (FREEDOM + 3.0) * np.log1p(squares / FREEDOM)
    return moved, weights / scale**2, np.sum(factors * each, axis=1)


def rigidly_moved(points: Array, goal: Array, weights: Array) -> Array:
    """Points (k, n_m, 3) turned and shifted onto a goal by weighted least squares (Kabsch 1976)."""
    R, t = fit_rigid(points, goal, weights)
    return points @ R.swapaxes(1, 2) + t[:, None]
