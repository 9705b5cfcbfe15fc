"""Pose of a rigid set of points from their measured positions, batched over time."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from freeswing.cdpr.rotation import nearest_rotation, skew

Array = NDArray[np.float64]

FEWEST_POINTS = 3
LEAST_SPREAD = 0.02  # of the extent: nearer to a line the turn about it is 50 times worse told
LEAST_SIZE_M = 1e-6


def fit_rigid(
    layout: ArrayLike, points: ArrayLike, weights: ArrayLike | None = None
) -> tuple[Array, Array]:
    """Rotations and translations that least-squares map `layout` onto `points` (Kabsch 1976).

    Args:
        layout: points in the body frame, (n_m, 3).
        points: measured points, NaN where missing, (n_t, n_m, 3).
        weights: inverse variances, broadcast to (n_t, n_m); 1 when None.

    Returns:
        R (n_t, 3, 3) and t (n_t, 3) with points = R layout + t; NaN where fewer than three points,
        or only points on a line, are known.
    """
    layout = np.asarray(layout, dtype=np.float64)
    points = np.asarray(points, dtype=np.float64)
    w, x = _usable(points, weights)
    determined = _is_determined(layout, w > 0.0)
    total = np.where(determined, w.sum(axis=1), 1.0)[:, None]
    centre_layout = w @ layout / total
    centre_points = np.einsum("tm,tmi->ti", w, x) / total
    cross = np.einsum("tm,tmi,mj->tij", w, x, layout)
    cross -= total[:, :, None] * centre_points[:, :, None] * centre_layout[:, None, :]
    R = nearest_rotation(cross)
    t = centre_points - np.einsum("tij,tj->ti", R, centre_layout)
    R[~determined], t[~determined] = np.nan, np.nan
    return R, t


def is_planar_or_better(layout: ArrayLike) -> bool:
    """Whether the points (n, 3) fix an orientation: three or more, not on a line."""
    points = np.asarray(layout, dtype=np.float64).reshape(-1, 3)
    if len(points) < FEWEST_POINTS:
        return False
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[1] > max(LEAST_SPREAD * spread[0], LEAST_SIZE_M))


def _usable(points: Array, weights: ArrayLike | None) -> tuple[Array, Array]:
    """Weights (n_t, n_m), zero where a point is missing, and points with zeros there."""
    seen = np.asarray(np.isfinite(points).all(axis=2))
    given = 1.0 if weights is None else np.asarray(weights, dtype=np.float64)
    w = np.where(seen, np.broadcast_to(given, seen.shape), 0.0)
    return w, np.where(seen[:, :, None], points, 0.0)


def _is_determined(layout: Array, seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Samples whose known points fix an orientation, (n_t,)."""
    packed = np.packbits(seen, axis=1)
    codes = packed[:, 0] if packed.shape[1] == 1 else packed  # rows are ten times slower to sort
    axis = 0 if codes.ndim == 2 else None
    _, first, which = np.unique(codes, axis=axis, return_index=True, return_inverse=True)
    good = np.array([is_planar_or_better(layout[pattern]) for pattern in seen[first]], dtype=bool)
    return good[which.reshape(-1)]


def pose_covariances(layout: Array, R: Array, weights: Array) -> Array:
    """Covariances (n_t, 6, 6) of (t, delta) for markers of weights, one over variance, (n_t, n_m).

    NaN where the markers with weight do not fix a pose.

    Source:
        Press et al. 2007, Numerical Recipes, sec. 15.6: inverse of the normal matrix.
    """
    determined = _is_determined(layout, weights > 0.0) & np.isfinite(R[:, 0, 0])
    arms = np.einsum("tij,mj->tmi", np.where(determined[:, None, None], R, 0.0), layout)
    jacobian = np.zeros((*weights.shape, 3, 6))
    jacobian[..., :3] = np.eye(3)
    jacobian[..., 3:] = -skew(arms)
    information = np.einsum("tm,tmki,tmkj->tij", weights, jacobian, jacobian, optimize=True)
    covariances = np.full((len(weights), 6, 6), np.nan)
    covariances[determined] = np.linalg.inv(information[determined])
    return covariances
