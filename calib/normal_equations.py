"""Normal equations of a rig, and their solution with every board pose eliminated block by block.

The equations of cameras, warp and base points (shared, p of them) and of n_moments board poses are
an arrow; eliminating the 6 x 6 blocks leaves a dense p x p system (Schur complement, Triggs et al.
2000, "Bundle Adjustment", sec. 6.1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calib.camera_models import Array
from calib.reprojection import (
    WARP,
    Scene,
    board_jacobians,
    camera_slices,
    fixed_jacobians,
)
from calib.views import FixedPoints, Views, relative_std

HUBER_SIGMAS = 3.0
_RANK_TOLERANCE = 1e-13


@dataclass(frozen=True, slots=True)
class Problem:
    """Data and choices of one adjustment.

    Attributes:
        board_points_m: the board's corners, (n_points, 3).
        views: sightings of the board, ordered by camera, one per camera and moment.
        fixed: surveyed points, None without.
        free: which shared unknowns may move, in the order of `calib.reprojection`, bool (p,).
    """

    board_points_m: Array
    views: Views
    fixed: FixedPoints | None
    free: np.ndarray


@dataclass(frozen=True, slots=True)
class Normal:
    """Blocks of the normal equations: J'WJ and J'Wr of shared unknowns and board poses."""

    shared: Array  # (p, p)
    cross: Array  # (n_moments, p, 6)
    boards: Array  # (n_moments, 6, 6)
    shared_slope: Array  # (p,)
    board_slopes: Array  # (n_moments, 6)


def normal_equations(scene: Scene, problem: Problem, sigma: Array) -> Normal:
    """Normal equations at `scene`, robust weights included; `sigma` is each camera's noise, px."""
    slices = camera_slices(scene.cameras)
    end = slices[-1].stop
    p, n_moments = len(problem.free), len(scene.T_base_boards)
    shared, slope = np.zeros((p, p)), np.zeros(p)
    cross, boards = np.zeros((n_moments, p, 6)), np.zeros((n_moments, 6, 6))
    board_slopes = np.zeros((n_moments, 6))
    warp = slice(end, end + WARP)
    relative = relative_std(problem.views)
    for index, own in enumerate(slices):
        views_of = problem.views.camera == index
        views = problem.views.select(views_of)
        if not len(views):
            continue
        residuals, *blocks = board_jacobians(scene, problem.board_points_m, views, index)
        scale = _root_weights(residuals, sigma[index] * relative[views_of])[..., None, None]
        r, d_camera, d_board, d_warp = (
            _rows(np.where(scale > 0.0, array * scale, 0.0))
            for array in (residuals[..., None], *blocks)
        )
        wide = np.concatenate([d_camera, d_warp], axis=-1)
        flat = wide.reshape(-1, wide.shape[-1])
        columns = np.r_[own, warp]
        shared[np.ix_(columns, columns)] += flat.T @ flat
        slope[columns] += flat.T @ r.reshape(-1)
        d_board_t = np.swapaxes(d_board, 1, 2)
        np.add.at(boards, views.moment, d_board_t @ d_board)
        np.add.at(board_slopes, views.moment, (d_board_t @ r)[..., 0])
        block = np.swapaxes(d_board_t @ wide, 1, 2)
        cross[views.moment, own] = block[:, :-WARP]
        cross[views.moment, warp] += block[:, -WARP:]
    if problem.fixed is not None:
        _add_fixed(scene, problem.fixed, sigma, shared, slope)
    return Normal(shared, cross, boards, slope, board_slopes)


def _add_fixed(scene: Scene, fixed: FixedPoints, sigma: Array, shared: Array, slope: Array) -> None:
    """Add the fixed points' sightings and their survey to the shared block."""
    slices = camera_slices(scene.cameras)
    first = slices[-1].stop + WARP
    for index, own in enumerate(slices):
        some = fixed.select(fixed.camera == index)
        if not len(some.point):
            continue
        residuals, d_camera, d_point = fixed_jacobians(scene, some, index)
        scale = _root_weights(residuals, sigma[index] * some.std_scale)[:, None]
        rows = np.zeros((len(some.point), 2, len(slope)))
        rows[..., own] = d_camera
        for axis in range(3):
            columns = first + 3 * some.point + axis
            rows[np.arange(len(columns)), :, columns] = d_point[..., axis]
        rows = (rows * scale[..., None]).reshape(-1, len(slope))
        shared += rows.T @ rows
        slope += rows.T @ (residuals * scale).reshape(-1)
    information = np.repeat(1.0 / fixed.std_m**2, 3)
    diagonal = first + np.arange(information.size)
    shared[diagonal, diagonal] += information
    slope[diagonal] += information * (fixed.points_base_m - scene.base_points_m).reshape(-1)


def _rows(array: Array) -> Array:
    """(n, n_points, 2, c) -> (n, 2 n_points, c)."""
    return array.reshape(array.shape[0], -1, array.shape[-1])


def _root_weights(residuals: Array, sigma: Array | float) -> Array:
    """Square roots of the robust weights over sigma; zero where unseen. (..., 2) -> (...)."""
    error = np.hypot(residuals[..., 0], residuals[..., 1]) / sigma
    with np.errstate(invalid="ignore"):
        weight = np.sqrt(np.minimum(1.0, HUBER_SIGMAS / np.maximum(error, 1e-12))) / sigma
    return np.where(np.isfinite(error), weight, 0.0)


def damped_step(normal: Normal, free: np.ndarray, damping: float) -> tuple[Array, Array]:
    """Levenberg-Marquardt step of shared unknowns (p,) and boards (n, 6); NaN when singular."""
    boards = normal.boards.copy()
    diagonal = np.einsum("nii->ni", boards)
    diagonal *= 1.0 + damping
    diagonal += 1e-12 * np.maximum(1.0, diagonal)
    cross = normal.cross[:, free]
    shared = normal.shared[np.ix_(free, free)]
    scale = np.einsum("ii->i", shared).copy()
    reduced, weighted = _reduced(shared, cross, boards)
    reduced[np.diag_indices_from(reduced)] += damping * scale + 1e-14 * np.maximum(scale, 1.0)
    slope = normal.shared_slope[free] - np.einsum("npi,ni->p", weighted, normal.board_slopes)
    step = np.zeros(len(free))
    try:
        step[free] = np.linalg.solve(reduced, slope)
    except np.linalg.LinAlgError:
        step[free] = np.nan
    rest = normal.board_slopes - np.einsum("npi,p->ni", cross, step[free])
    return step, np.linalg.solve(boards, rest[..., None])[..., 0]


def _reduced(shared: Array, cross: Array, boards: Array) -> tuple[Array, Array]:
    """Schur complement of the board blocks, and cross @ inverse(boards)."""
    weighted: Array = cross @ np.linalg.inv(boards).astype(np.float64)
    p = shared.shape[0]
    width = boards.shape[0] * boards.shape[1]
    flat = np.swapaxes(weighted, 0, 1).reshape(p, width)
    return shared - flat @ np.swapaxes(cross, 0, 1).reshape(p, width).T, weighted


def covariances(normal: Normal, free: np.ndarray) -> tuple[Array, Array, int, Array, float]:
    """Covariances of shared unknowns (p, p) and boards (n, 6, 6), rank, weakest, condition.

    Directions without rank are left out; `weakest` is the least determined one, a unit vector.
    """
    if not free.any():
        nothing = np.zeros(len(free))
        covariance = np.zeros((len(free), len(free)))
        inverse = np.linalg.inv(normal.boards + 1e-12 * np.eye(6)).astype(np.float64)
        return covariance, inverse, 0, nothing, 1.0
    cross = normal.cross[:, free]
    boards = normal.boards + 1e-12 * np.eye(6)
    reduced, weighted = _reduced(normal.shared[np.ix_(free, free)], cross, boards)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal.shared)[free], 1e-300))
    values, vectors = np.linalg.eigh(reduced * scale[:, None] * scale)
    kept = values > _RANK_TOLERANCE * max(float(values[-1]), 1e-300)
    half = scale[:, None] * vectors[:, kept] / np.sqrt(values[kept])
    covariance = np.zeros((len(free), len(free)))
    covariance[np.ix_(free, free)] = half @ half.T
    spread = np.swapaxes(weighted, 1, 2) @ half
    board_covariances = np.linalg.inv(boards) + spread @ np.swapaxes(spread, 1, 2)
    weakest = np.zeros(len(free))
    weakest[free] = scale * vectors[:, 0]
    weakest /= np.linalg.norm(weakest)
    condition = float(values[-1] / max(values[0], 1e-300))
    return covariance, board_covariances, int(kept.sum()), weakest, condition
