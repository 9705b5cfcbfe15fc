"""Bundle adjustment: Levenberg-Marquardt with every board pose eliminated block by block.

Residuals are whitened by each camera's corner noise, Huber's loss bounds what a single corner can
do, and base points carry their survey as prior. The algebra is in `calib.normal_equations`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from calib.camera_models import Array
from calib.normal_equations import (
    HUBER_SIGMAS,
    Problem,
    covariances,
    damped_step,
    normal_equations,
)
from calib.reprojection import Scene, board_residuals, fixed_residuals, moved
from calib.views import relative_std

MOST_ITERATIONS = 60
# expected fall of the cost at which to stop, in units where one residual of 1 sigma counts 1/2
CONVERGED = 1e-7
ROUGHLY_CONVERGED = 1e-2
MEDIAN_OF_RAYLEIGH = 1.1774100225154747  # median length of a 2-D error of unit standard deviation


@dataclass(frozen=True, slots=True)
class Adjustment:
    """Result of one adjustment.

    Attributes:
        scene: the estimate.
        covariance: of the shared unknowns (zero where held), (p, p).
        board_covariances: of the board poses (dt, dr), (n_moments, 6, 6).
        sigma_px: noise of each camera's typical corner, each axis, (n_cameras,).
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


def adjust(
    scene: Scene,
    problem: Problem,
    sigma_px: Array | None = None,
    rounds: int = 2,
    converged: float = CONVERGED,
) -> Adjustment:
    """Adjust `scene` to the sightings.

    Args:
        scene: the start.
        problem: data and free unknowns.
        sigma_px: noise of each camera to start from; measured from the residuals when None.
        rounds: how often the noise is measured again and the adjustment repeated.
        converged: expected fall of the cost at which to stop.
    """
    iterations, stop, cost = 0, "", np.inf
    sigma = _noise(scene, problem, None) if sigma_px is None else np.array(sigma_px, dtype=float)
    for turn in range(rounds):
        if turn:
            sigma = _noise(scene, problem, sigma)
        scene, cost, steps, stop = _minimise(scene, problem, sigma, converged)
        iterations += steps
    sigma = _noise(scene, problem, sigma)
    normal = normal_equations(scene, problem, sigma)
    covariance, boards, rank, weakest, condition = covariances(normal, problem.free)
    residuals, fixed = _all_residuals(scene, problem)
    return Adjustment(
        scene, covariance, boards, sigma, residuals, fixed, cost, rank, weakest, condition,
        iterations, stop,
    )  # fmt: skip


def _minimise(
    scene: Scene, problem: Problem, sigma: Array, converged: float
) -> tuple[Scene, float, int, str]:
    damping, growth = 1e-4, 4.0
    cost = _cost(scene, problem, sigma)
    normal = normal_equations(scene, problem, sigma)
    for iteration in range(1, MOST_ITERATIONS + 1):
        shared, boards = damped_step(normal, problem.free, damping)
        fall = float(shared @ normal.shared_slope + np.sum(boards * normal.board_slopes)) / 2.0
        if not np.isfinite(fall):
            return scene, cost, iteration, "the normal equations cannot be solved"
        trial = moved(scene, shared, boards)
        trial_cost = _cost(trial, problem, sigma)
        if trial_cost <= cost:
            scene, cost = trial, trial_cost
            if fall < converged and damping <= 1e-3:
                return scene, cost, iteration, "converged"
            normal = normal_equations(scene, problem, sigma)
            damping, growth = max(damping * 0.1, 1e-12), 4.0
        elif fall < converged:
            return scene, cost, iteration, "converged to rounding"
        else:
            damping, growth = damping * growth, growth * 2.0
    return scene, cost, MOST_ITERATIONS, f"stopped after {MOST_ITERATIONS} steps"


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
    noise = sigma[problem.views.camera][:, None] * relative_std(problem.views)
    errors = [np.hypot(*np.moveaxis(board, -1, 0)) / noise]
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
    """Noise of each camera's typical corner: rms of residuals within the knee, freedom-corrected.

    The first call has no scale and takes the median; cameras without views get the others' mean.
    """
    board, _ = _all_residuals(scene, problem)
    board = board / relative_std(problem.views)[..., None]
    count = len(scene.cameras)
    sigma = np.full(count, np.nan)
    for index in range(count):
        residuals = board[problem.views.camera == index]
        length = np.hypot(residuals[..., 0], residuals[..., 1])
        length = length[np.isfinite(length)]
        if not length.size:
            continue
        median = max(float(np.median(length)) / MEDIAN_OF_RAYLEIGH, 1e-4)
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
    """Names of the shared unknowns, such as `cam0.fx` or `board.sag_x_m`, in order."""
    from calib.camera_models import PARAMETER_NAMES

    names = []
    for camera in scene.cameras:
        own = [*PARAMETER_NAMES[camera.model], "tx_m", "ty_m", "tz_m", "rx_rad", "ry_rad", "rz_rad"]
        names += [f"{camera.name}.{name}" for name in (*own, "clock_offset_s", "line_time_s")]
    names += ["board.sag_x_m", "board.sag_y_m", "board.tag_growth_m"]
    points = range(len(scene.base_points_m))
    return names + [f"base_point_{index}.{axis}_m" for index in points for axis in "xyz"]


def with_free(problem: Problem, free: np.ndarray) -> Problem:
    """The same problem with other unknowns free."""
    return replace(problem, free=free)
