"""Bundle adjustment: Levenberg-Marquardt with every board pose eliminated block by block.

Residuals are whitened by each camera's corner noise, Huber's loss bounds what a single corner can
do, and base points carry their survey as prior. The algebra is in `calib.rig.normal_equations`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.normal_equations import (
    WITHIN_KNEE,
    Normal,
    Problem,
    covariances,
    damped_step,
    length_with_share,
    normal_equations,
)
from freeswing.calib.rig.reprojection import Scene, board_residuals, fixed_residuals, moved
from freeswing.cdpr import descent
from freeswing.cdpr.descent import Damping, LevenbergMarquardt, Stop

MOST_ITERATIONS = 60
SOLVER = LevenbergMarquardt(MOST_ITERATIONS, Damping(growth=4.0, faster=2.0), level=True)
_HARDLY_DAMPED = 1e-3  # a step so damped is as good as the full one
# expected fall of the cost at which to stop, in units where one residual of 1 sigma counts 1/2
CONVERGED = 1e-7
ROUGHLY_CONVERGED = 1e-2
_COMMON_FREEDOM = 30.0  # numbers: a deviation of so many is good to an eighth
_LEAST_FREEDOM = 0.1  # of a camera's numbers: what is said free of all by counting is not
MEDIAN_OF_RAYLEIGH = 1.1774100225154747  # median length of a 2-D error of unit standard deviation


@dataclass(frozen=True, slots=True)
class Adjustment:
    """Result of one adjustment.

    Attributes:
        scene: the estimate.
        covariance: of the shared unknowns (zero where held), (p, p).
        board_covariances: of the board motions, from (dt, dr) on, (n_pieces, b, b).
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
    residuals = board_residuals(scene, problem.board_points_m, problem.views)
    first = _noise(scene, problem, residuals, None) if sigma_px is None else sigma_px
    sigma = np.array(first, dtype=np.float64)
    for turn in range(rounds):
        if turn:
            sigma = _noise(scene, problem, residuals, sigma)
        search = _Search(problem, sigma, converged)
        ended, steps, reason = SOLVER.descend(search, search.at(scene))
        scene, cost, stop = ended.scene, ended.cost, reason.sentence
        residuals = board_residuals(scene, problem.board_points_m, problem.views)
        iterations += steps
    sigma = _noise(scene, problem, residuals, sigma)
    normal = normal_equations(scene, problem, sigma)
    covariance, boards, rank, weakest, condition = covariances(normal, problem.free)
    covariance = problem.spread(problem.spread(covariance).T)
    fixed = np.zeros((0, 2)) if problem.fixed is None else fixed_residuals(scene, problem.fixed)
    return Adjustment(
        scene, covariance, boards, sigma, residuals, fixed, cost, rank, weakest, condition,
        iterations, stop,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _At:
    """A scene and its normal equations."""

    scene: Scene
    normal: Normal

    @property
    def cost(self) -> float:
        return self.normal.cost


@dataclass(frozen=True, slots=True)
class _Step:
    """Changes of what is shared and of the boards, and the fall of cost they promise."""

    shared: Array
    boards: Array
    promised: float


@dataclass(frozen=True, slots=True)
class _Search:
    """A problem with a noise, as `LevenbergMarquardt` takes it."""

    problem: Problem
    sigma: Array
    converged: float

    def at(self, scene: Scene) -> _At:
        """A place of the search."""
        return _At(scene, normal_equations(scene, self.problem, self.sigma))

    def step(self, place: _At, damping: float) -> _Step | None:
        """None where the normal equations are singular."""
        normal = place.normal
        shared, boards = damped_step(normal, self.problem.free, damping)
        fall = float(shared @ normal.shared_slope + np.sum(boards * normal.board_slopes)) / 2.0
        if not np.isfinite(fall):
            return None
        if self.problem.points_only:
            boards = np.pad(boards, ((0, 0), (0, 3)))
        return _Step(self.problem.spread(shared), boards, fall)

    def moved(self, place: _At, step: _Step) -> _At:
        """The scene after a step, its cost infinite where a corner cannot be seen."""
        return self.at(moved(place.scene, step.shared, step.boards))

    def ended(
        self, place: _At, step: _Step, trial: _At | None, lower: bool, damping: float
    ) -> Stop | None:
        """Once a step promises next to nothing."""
        if step.promised >= self.converged:
            return None
        if not lower:
            return descent.AT_ROUNDING
        return descent.CONVERGED if damping <= _HARDLY_DAMPED else None


def _noise(scene: Scene, problem: Problem, residuals: Array, last: Array | None) -> Array:
    """Noise of each camera's typical corner: rms of residuals within the knee, freedom-corrected.

    The first call has no scale and takes the median. A camera with few residuals cannot tell its
    noise: the mean of all counts beside it, as `_COMMON_FREEDOM` residuals of its own.
    """
    white = problem.views.whitened(residuals)
    size = white.shape[-1]
    lengths = np.linalg.norm(white, axis=-1)
    knee = length_with_share(WITHIN_KNEE, size)
    middle = length_with_share(0.5, size)
    squares, freedoms = np.zeros(len(scene.cameras)), np.zeros(len(scene.cameras))
    for index in range(len(squares)):
        length = lengths[problem.views.camera == index]
        length = length[np.isfinite(length)]
        if not length.size:
            continue
        median = max(float(np.median(length)) / middle, 1e-4)
        if last is None:
            freedoms[index] = size * length.size
            squares[index] = freedoms[index] * median**2
            continue
        inside = length[length < knee * median]
        share = max(1.0 - _unknowns_per_residual(scene, problem, index), _LEAST_FREEDOM)
        freedoms[index] = share * size * inside.size
        squares[index] = float(np.sum(inside**2)) / _kept_share(size)
    common = squares.sum() / freedoms.sum() if freedoms.any() else 1.0
    return np.sqrt((squares + _COMMON_FREEDOM * common) / (freedoms + _COMMON_FREEDOM))


@cache
def _kept_share(size: int) -> float:
    """Mean square of a unit normal error in `size` axes cut at the knee, over its full value."""
    from scipy.special import gammainc

    knee = length_with_share(WITHIN_KNEE, size)
    return float(gammainc(size / 2.0 + 1.0, knee**2 / 2.0)) / WITHIN_KNEE


def _unknowns_per_residual(scene: Scene, problem: Problem, index: int) -> float:
    """Share of a camera's residuals that its unknowns, and its share of the boards', use up."""
    seen = problem.views.seen.sum(axis=1).astype(float)
    per_piece = np.bincount(problem.views.piece, weights=seen)
    own = problem.views.camera == index
    piece = problem.views.piece[own]
    # a single point has no direction
    unknowns = min(scene.board_unknowns, 3 * len(problem.board_points_m))
    boards = float(np.sum(unknowns * seen[own] / per_piece[piece]))
    return (boards + problem.free.sum() / len(scene.cameras)) / (2.0 * seen[own].sum())


def named(scene: Scene) -> list[str]:
    """Names of the shared unknowns, such as `cam0.fx` or `board.sag_x_m`, in order."""
    from freeswing.calib.camera.lens_models import PARAMETER_NAMES

    names = []
    for camera in scene.cameras:
        own = [*PARAMETER_NAMES[camera.model], "tx_m", "ty_m", "tz_m", "rx_rad", "ry_rad", "rz_rad"]
        names += [f"{camera.name}.{name}" for name in (*own, "clock_offset_s", "line_time_s")]
    names += ["board.sag_x_m", "board.sag_y_m", "board.tag_growth_m"]
    kinds = ("x_m", "y_m", "z_m", "about_x_m", "about_y_m", "about_z_m")
    tags = range((len(scene.warp_m) - 3) // len(kinds))
    names += [f"platform_tag_{index}.{kind}" for index in tags for kind in kinds]
    points = range(len(scene.base_points_m))
    return names + [f"base_point_{index}.{axis}_m" for index in points for axis in "xyz"]
