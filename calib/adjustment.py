"""Bundle adjustment: Levenberg-Marquardt with every board pose eliminated block by block.

The normal equations of cameras, warp and base points (shared, p of them) and of n_moments board
poses are an arrow; eliminating the 6 x 6 blocks leaves a dense p x p system (Schur complement,
Triggs et al. 2000, "Bundle Adjustment", sec. 6.1). Residuals are whitened by each camera's corner
noise, Huber's loss bounds what a single corner can do, and base points carry their survey as prior.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from calib.camera_models import Array
from calib.reprojection import (
    WARP,
    Scene,
    board_jacobians,
    board_residuals,
    camera_slices,
    fixed_jacobians,
    fixed_residuals,
    moved,
)
from calib.views import FixedPoints, Views

HUBER_SIGMAS = 3.0
MOST_ITERATIONS = 60
_DECREMENT = 1e-7  # expected fall of the cost, in units where one residual counts 1/2
_RANK_TOLERANCE = 1e-13
_MAD_OF_RAYLEIGH = 1.1774100225154747  # median length of a 2-D error of unit standard deviation


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
class Adjustment:
    """Result of one adjustment.

    Attributes:
        scene: the estimate.
        covariance: of the shared unknowns (zero where held), (p, p).
        board_covariances: of the board poses (dt, dr), (n_moments, 6, 6).
        sigma_px: corner noise of each camera, each axis, (n_cameras,).
        residuals_px: board residuals, NaN where unseen, (n_views, n_points, 2).
        fixed_residuals_px: residuals of the fixed points, (m, 2).
        cost: half the whitened robust sum of squares.
        rank: of the reduced system, out of `free.sum()`.
        weakest: unit vector of the least determined direction, (p,).
        condition: ratio of the scaled reduced system's largest to smallest eigenvalue.
        iterations: steps tried.
        stop: why it ended.
    """

    scene: Scene
    covariance: Array
    board_covariances: Array
    sigma_px: Array
    residuals_px: Array
    fixed_residuals_px: Array
    cost: float
    rank: int
    weakest: Array
    condition: float
    iterations: int
    stop: str


@dataclass(frozen=True, slots=True)
class _Normal:
    shared: Array  # (p, p)
    cross: Array  # (n_moments, p, 6)
    boards: Array  # (n_moments, 6, 6)
    shared_slope: Array  # (p,)
    board_slopes: Array  # (n_moments, 6)


def adjust(
    scene: Scene, problem: Problem, sigma_px: Array | None = None, rounds: int = 2
) -> Adjustment:
    """Adjust `scene` to the sightings.

    Args:
        scene: the start.
        problem: data and free unknowns.
        sigma_px: noise of each camera to start from; measured from the residuals when None.
        rounds: how often the noise is measured again and the adjustment repeated.
    """
    iterations, stop, cost = 0, "", np.inf
    sigma = _noise(scene, problem, None) if sigma_px is None else np.array(sigma_px, dtype=float)
    for turn in range(rounds):
        if turn:
            sigma = _noise(scene, problem, sigma)
        scene, cost, steps, stop = _minimise(scene, problem, sigma)
        iterations += steps
    sigma = _noise(scene, problem, sigma)
    normal = _normal_equations(scene, problem, sigma)
    covariance, boards, rank, weakest, condition = _covariances(normal, problem.free)
    residuals, fixed = _all_residuals(scene, problem)
    return Adjustment(
        scene, covariance, boards, sigma, residuals, fixed, cost, rank, weakest, condition,
        iterations, stop,
    )  # fmt: skip


def _minimise(scene: Scene, problem: Problem, sigma: Array) -> tuple[Scene, float, int, str]:
    damping, growth = 1e-4, 4.0
    cost = _cost(scene, problem, sigma)
    normal = _normal_equations(scene, problem, sigma)
    for iteration in range(1, MOST_ITERATIONS + 1):
        shared, boards = _step(normal, problem.free, damping)
        fall = float(shared @ normal.shared_slope + np.sum(boards * normal.board_slopes)) / 2.0
        if not np.isfinite(fall):
            return scene, cost, iteration, "the normal equations cannot be solved"
        trial = moved(scene, shared, boards)
        trial_cost = _cost(trial, problem, sigma)
        if trial_cost <= cost:
            scene, cost = trial, trial_cost
            if fall < _DECREMENT and damping <= 1e-3:
                return scene, cost, iteration, "converged"
            normal = _normal_equations(scene, problem, sigma)
            damping, growth = max(damping * 0.1, 1e-12), 4.0
        elif fall < _DECREMENT:
            return scene, cost, iteration, "converged to rounding"
        else:
            damping, growth = damping * growth, growth * 2.0
    return scene, cost, MOST_ITERATIONS, f"stopped after {MOST_ITERATIONS} steps"


def _normal_equations(scene: Scene, problem: Problem, sigma: Array) -> _Normal:
    slices = camera_slices(scene.cameras)
    end = slices[-1].stop
    p, n_moments = len(problem.free), len(scene.T_base_boards)
    shared, slope = np.zeros((p, p)), np.zeros(p)
    cross, boards = np.zeros((n_moments, p, 6)), np.zeros((n_moments, 6, 6))
    board_slopes = np.zeros((n_moments, 6))
    warp = slice(end, end + WARP)
    for index, own in enumerate(slices):
        views = problem.views.select(problem.views.camera == index)
        if not len(views):
            continue
        residuals, *blocks = board_jacobians(scene, problem.board_points_m, views, index)
        scale = _root_weights(residuals, sigma[index])[..., None, None]
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
    return _Normal(shared, cross, boards, slope, board_slopes)


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


def _step(normal: _Normal, free: np.ndarray, damping: float) -> tuple[Array, Array]:
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
    weighted = np.swapaxes(np.linalg.solve(boards, np.swapaxes(cross, 1, 2)), 1, 2)
    p = shared.shape[0]
    flat = np.swapaxes(weighted, 0, 1).reshape(p, -1)
    return shared - flat @ np.swapaxes(cross, 0, 1).reshape(p, -1).T, weighted


def _covariances(normal: _Normal, free: np.ndarray) -> tuple[Array, Array, int, Array, float]:
    """Covariances of shared unknowns and boards; directions without rank are left out."""
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


def _all_residuals(scene: Scene, problem: Problem) -> tuple[Array, Array]:
    board = np.full(problem.views.pixels.shape, np.nan)
    for index in range(len(scene.cameras)):
        own = problem.views.camera == index
        views = problem.views.select(own)
        board[own] = board_residuals(scene, problem.board_points_m, views, index)
    fixed = problem.fixed
    if fixed is None:
        return board, np.zeros((0, 2))
    return board, fixed_residuals(scene, fixed)


def _cost(scene: Scene, problem: Problem, sigma: Array) -> float:
    board, fixed = _all_residuals(scene, problem)
    seen = problem.views.seen
    errors = [np.hypot(*np.moveaxis(board, -1, 0)) / sigma[problem.views.camera][:, None]]
    errors[0] = errors[0][seen]
    prior = 0.0
    if problem.fixed is not None:
        noise = sigma[problem.fixed.camera] * problem.fixed.std_scale
        errors.append(np.hypot(fixed[:, 0], fixed[:, 1]) / noise)
        change = (scene.base_points_m - problem.fixed.points_base_m) / problem.fixed.std_m[:, None]
        prior = 0.5 * float(np.sum(change**2))
    error = np.concatenate(errors)
    if not np.isfinite(error).all():
        return np.inf
    knee = HUBER_SIGMAS
    loss = np.where(error < knee, 0.5 * error**2, knee * error - 0.5 * knee**2)
    return float(loss.sum()) + prior


def _noise(scene: Scene, problem: Problem, last: Array | None) -> Array:
    """Corner noise of each camera: rms of residuals within the knee, freedom-corrected.

    The first call has no scale and takes the median; cameras without views get the others' mean.
    """
    board, _ = _all_residuals(scene, problem)
    count = len(scene.cameras)
    sigma = np.full(count, np.nan)
    for index in range(count):
        residuals = board[problem.views.camera == index]
        length = np.hypot(residuals[..., 0], residuals[..., 1])
        length = length[np.isfinite(length)]
        if not length.size:
            continue
        median = max(float(np.median(length)) / _MAD_OF_RAYLEIGH, 1e-4)
        if last is None:
            sigma[index] = median
            continue
        inside = length < HUBER_SIGMAS * median
        freedom = 1.0 - _unknowns_per_residual(problem, index)
        mean_square = float(np.mean(length[inside] ** 2)) / 2.0 / _kept_share()
        sigma[index] = np.sqrt(mean_square / max(freedom, 0.1))
    known = np.isfinite(sigma)
    return np.where(known, sigma, sigma[known].mean() if known.any() else 1.0)


def _kept_share() -> float:
    """Mean square of a unit 2-D normal error cut at the knee, over its full value."""
    knee2 = HUBER_SIGMAS**2 / 2.0
    inside = 1.0 - np.exp(-knee2)
    return float((1.0 - np.exp(-knee2) * (1.0 + knee2)) / inside)


def _unknowns_per_residual(problem: Problem, index: int) -> float:
    """Share of a camera's residuals that its unknowns, and its share of the boards', use up."""
    seen = problem.views.seen.sum(axis=1).astype(float)
    per_moment = np.bincount(problem.views.moment, weights=seen)
    own = problem.views.camera == index
    boards = float(np.sum(6.0 * seen[own] / per_moment[problem.views.moment[own]]))
    return (boards + problem.free.sum() / (problem.views.camera.max() + 1)) / (
        2.0 * seen[own].sum()
    )


def named(scene: Scene) -> list[str]:
    """Names of the shared unknowns, such as `cam0.fx` or `warp.x_m`, in order."""
    from calib.camera_models import PARAMETER_NAMES

    names = []
    for camera in scene.cameras:
        own = [*PARAMETER_NAMES[camera.model], "tx_m", "ty_m", "tz_m", "rx_rad", "ry_rad", "rz_rad"]
        names += [f"{camera.name}.{name}" for name in (*own, "clock_offset_s", "line_time_s")]
    names += ["warp.x_m", "warp.y_m"]
    points = range(len(scene.base_points_m))
    return names + [f"base_point_{index}.{axis}_m" for index in points for axis in "xyz"]


def with_free(problem: Problem, free: np.ndarray) -> Problem:
    """The same problem with other unknowns free."""
    return replace(problem, free=free)
