"""Pose of a rigid set of points from their measured positions, batched over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.rotation import skew

Array = NDArray[np.float64]

FEWEST_POINTS = 3
LEAST_SPREAD = 0.02
LEAST_SIZE_M = 1e-6
LAYOUT_ROUNDS = 20
LAYOUT_TOLERANCE_M = 1e-9


@dataclass(frozen=True, slots=True)
class MarkerFit:
    """Poses of a marker set; samples with too few markers are NaN.

    Attributes:
        positions_m: origin of the platform frame, (n_t, 3).
        rotations: R_base_platform, (n_t, 3, 3).
        covariances: of position, then small rotation vector in the base frame, (n_t, 6, 6).
        rms_m: residual rms over the markers of a sample, (n_t,).
        n_markers: markers used in a sample, (n_t,).
        noise_std_m: standard deviation of a marker coordinate, estimated from the residuals.
        layout_m: marker positions used, platform frame, (n_m, 3).
        layout_change_m: those minus the nominal ones, (n_m, 3).
    """

    positions_m: Array
    rotations: Array
    covariances: Array
    rms_m: Array
    n_markers: NDArray[np.intp]
    noise_std_m: float
    layout_m: Array
    layout_change_m: Array


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
    U, _, Vt = np.linalg.svd(cross)
    mirrored = np.linalg.det(U @ Vt) < 0.0
    U[mirrored, :, 2] *= -1.0
    R = U @ Vt
    t = centre_points - np.einsum("tij,tj->ti", R, centre_layout)
    R[~determined], t[~determined] = np.nan, np.nan
    return R, t


def fit_markers(layout: ArrayLike, points: ArrayLike, *, refine_layout: bool = True) -> MarkerFit:
    """Poses of a marker set over a run, with covariances from the residuals' own size.

    A layout known to a millimetre makes the pose jump whenever a marker is hidden. So the layout is
    first refined on the run itself (each marker moved to its mean place in the platform frame, the
    whole brought back onto the nominal layout), which leaves noise alone in the residuals.

    Args:
        layout: nominal marker positions, platform frame, (n_m, 3).
        points: measured positions, base frame, NaN where missing, (n_t, n_m, 3).
        refine_layout: False keeps the nominal layout.

    Raises:
        DataError: when no sample shows three markers that are not on a line.
    """
    nominal = np.asarray(layout, dtype=np.float64)
    points = np.asarray(points, dtype=np.float64)
    used = _refined(nominal, points) if refine_layout else nominal
    R, t = fit_rigid(used, points)
    determined = np.isfinite(t[:, 0])
    if not determined.any():
        most = int(np.isfinite(points).all(axis=2).sum(axis=1).max(initial=0))
        raise DataError(
            f"no sample shows {FEWEST_POINTS} markers that are not on a line (at most {most} at "
            "once); name the markers as in the target file, or add markers"
        )
    residuals = points - np.einsum("tij,mj->tmi", R, used) - t[:, None, :]
    seen = np.asarray(np.isfinite(residuals).all(axis=2))
    squares = np.where(seen[:, :, None], residuals, 0.0) ** 2
    n_markers = seen.sum(axis=1)
    rms = np.where(determined, np.sqrt(squares.sum(axis=(1, 2)) / np.maximum(n_markers, 1)), np.nan)
    noise = _noise_std(squares, seen, determined, refine_layout)
    covariances = noise**2 * _unit_covariances(used, R, seen, determined)
    return MarkerFit(t, R, covariances, rms, n_markers, noise, used, used - nominal)


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
    patterns, which = np.unique(seen, axis=0, return_inverse=True)
    good = np.array([is_planar_or_better(layout[pattern]) for pattern in patterns], dtype=bool)
    return good[which.reshape(-1)]


def _refined(nominal: Array, points: Array) -> Array:
    """Layout at the markers' mean places in the platform frame, aligned with the nominal one."""
    layout = nominal
    for _ in range(LAYOUT_ROUNDS):
        R, t = fit_rigid(layout, points)
        body = np.einsum("tij,tmi->tmj", R, points - t[:, None, :])
        seen = np.isfinite(body).all(axis=2)
        counts = seen.sum(axis=0)
        sums = np.where(seen[:, :, None], body, 0.0).sum(axis=0)
        means = np.where(counts[:, None] > 0, sums / np.maximum(counts, 1)[:, None], layout)
        observed = np.where(counts > 0, 1.0, 0.0)
        R_fit, t_fit = fit_rigid(means, nominal[None], observed[None])
        if not np.isfinite(t_fit).all():
            return nominal
        aligned = means @ R_fit[0].T + t_fit[0]
        aligned = np.where(counts[:, None] > 0, aligned, nominal)
        step = float(np.abs(aligned - layout).max(initial=0.0))
        layout = aligned
        if step < LAYOUT_TOLERANCE_M:
            break
    return layout


def _noise_std(
    squares: Array, seen: NDArray[np.bool_], determined: NDArray[np.bool_], refined: bool
) -> float:
    """Standard deviation of a marker coordinate; 0 when nothing is left over to tell it."""
    n_layout = max(3 * int(seen.any(axis=0).sum()) - 6, 0) if refined else 0
    freedom = 3 * int(seen.sum()) - 6 * int(determined.sum()) - n_layout
    return float(np.sqrt(squares.sum() / freedom)) if freedom > 0 else 0.0


def _unit_covariances(
    layout: Array, R: Array, seen: NDArray[np.bool_], determined: NDArray[np.bool_]
) -> Array:
    """(n_t, 6, 6) covariance of (t, delta) for marker noise of 1 m."""
    arms = np.einsum("tij,mj->tmi", np.where(determined[:, None, None], R, 0.0), layout)
    jacobian = np.zeros((*seen.shape, 3, 6))
    jacobian[..., :3] = np.eye(3)
    jacobian[..., 3:] = -skew(arms)
    jacobian *= seen[:, :, None, None]
    information = np.einsum("tmki,tmkj->tij", jacobian, jacobian, optimize=True)
    covariances = np.full((len(seen), 6, 6), np.nan)
    covariances[determined] = np.linalg.inv(information[determined])
    return covariances
