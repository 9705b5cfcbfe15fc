"""Normal equations of a rig, and their solution with every board pose eliminated block by block.

The equations of cameras, warp and base points (shared, p of them) and of n board motions are an
arrow; eliminating the b x b blocks leaves a dense p x p system (Schur complement, Triggs et al.
2000, "Bundle Adjustment", sec. 6.1).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

import numpy as np

from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.reprojection import (
    WARP,
    Scene,
    camera_slices,
    fixed_jacobians,
    kernel_estimate,
    kernel_views,
    shape_count,
)
from freeswing.calib.rig.view_equations import Normal, view_equations
from freeswing.calib.rig.views import FixedPoints, Views

# share of normal errors within Huber's knee; for single corners the knee is at 3 sigma
WITHIN_KNEE = 1.0 - np.exp(-4.5)
_RANK_TOLERANCE = 1e-13


@dataclass(frozen=True, slots=True)
class Problem:
    """Data and choices of one adjustment.

    Attributes:
        board_points_m: the board's corners, and after rows of NaN those of another rigid body (the
            platform), (n_points, 3).
        views: sightings of the board or of that body, ordered by camera, one per camera and moment.
        fixed: surveyed points, None without.
        free: which shared unknowns may move, in the order of `calib.rig.reprojection`, bool (p,).
        warp_std_m: how far the board's shape may be from its drawing, one standard deviation of
            each of `warp_m`, infinite where nothing is known beforehand, (3 + 6 n_tags,).
        equal: unknowns that are one: each of the first row is that of the second, and is not
            free: images of one camera have one lens, (2, k); None without.
    """

    board_points_m: Array
    views: Views
    fixed: FixedPoints | None
    free: np.ndarray
    warp_std_m: Array = field(default_factory=lambda: np.full(WARP, np.inf))
    equal: np.ndarray | None = None

    def spread(self, shared: Array) -> Array:
        """Shared unknowns along the last axis, what is equal filled in."""
        if self.equal is None:
            return shared
        full = np.array(shared)
        full[..., self.equal[0]] = full[..., self.equal[1]]
        return full

    @property
    def points_only(self) -> bool:
        """Whether boards are single points: they move and do not turn."""
        return len(self.board_points_m) == 1 and not self.board_points_m.any()


@cache
def length_with_share(share: float, size: int) -> float:
    """Length that a share of `size` unit normal numbers stays within."""
    from scipy.special import gammaincinv

    return float(np.sqrt(2.0 * gammaincinv(size / 2.0, share)))


def normal_equations(scene: Scene, problem: Problem, sigma: Array) -> Normal:
    """Normal equations at `scene`, robust weights included; `sigma` is each camera's noise, px.

    Raises:
        ValueError: when scene and problem count unknowns differently, which the kernels would not
            notice.
    """
    end = camera_slices(scene.cameras)[-1].stop
    shape = {len(scene.warp_m), len(problem.warp_std_m), shape_count(problem.board_points_m)}
    if len(shape) > 1 or len(problem.free) != end + len(scene.warp_m) + scene.base_points_m.size:
        raise ValueError(
            f"shapes of {shape} numbers, {len(problem.free)} unknowns: not one problem"
        )
    views = problem.views
    found = view_equations(
        kernel_views(views),
        kernel_estimate(scene, problem.board_points_m),
        sigma,
        length_with_share(WITHIN_KNEE, 2 * views.group_size),
        end,
        len(problem.free),
    )
    found = _with_shape(found, scene, problem.warp_std_m, end)
    if problem.fixed is not None:
        found = _with_fixed(found, scene, problem.fixed, sigma)
    if problem.points_only:
        cross, boards = found.cross[..., :3], found.boards[:, :3, :3]
        found = found._replace(
            cross=np.ascontiguousarray(cross),
            boards=np.ascontiguousarray(boards),
            board_slopes=np.ascontiguousarray(found.board_slopes[:, :3]),
        )
    return found if problem.equal is None else _gathered(found, problem.equal)


def _gathered(found: Normal, equal: np.ndarray) -> Normal:
    """The equations of unknowns that are one, at the place of the one that they equal."""
    shared, slope, cross = found.shared.copy(), found.shared_slope.copy(), found.cross.copy()
    for one in np.unique(equal[1]).tolist():
        many = equal[0, equal[1] == one]
        for array in (slope, shared, shared.T, np.swapaxes(cross, 0, 1)):
            array[one] += array[many].sum(axis=0)
            array[many] = 0.0
    return found._replace(shared=shared, shared_slope=slope, cross=cross)


def _with_shape(found: Normal, scene: Scene, std_m: Array, first: int) -> Normal:
    """The equations with what is known of the board's shape beforehand added."""
    shared, slope = found.shared.copy(), found.shared_slope.copy()
    rows = first + np.arange(len(std_m))
    shared[rows, rows] += 1.0 / std_m**2
    slope[rows] -= scene.warp_m / std_m**2
    cost = found.cost + 0.5 * float(np.sum((scene.warp_m / std_m) ** 2))
    return found._replace(shared=shared, shared_slope=slope, cost=cost)


def _with_fixed(found: Normal, scene: Scene, fixed: FixedPoints, sigma: Array) -> Normal:
    """The equations with the fixed points' sightings and their survey added to what is shared."""
    shared, slope = found.shared.copy(), found.shared_slope.copy()
    slices = camera_slices(scene.cameras)
    first = slices[-1].stop + len(scene.warp_m)
    knee = length_with_share(WITHIN_KNEE, 2)
    cost = 0.0
    for index, own in enumerate(slices):
        some = fixed.select(fixed.camera == index)
        if not len(some.point):
            continue
        residuals, d_camera, d_point = fixed_jacobians(scene, some, index)
        noise = sigma[index] * some.std_scale
        error = np.hypot(residuals[:, 0], residuals[:, 1]) / noise
        cost += float(np.where(error < knee, 0.5 * error**2, knee * error - 0.5 * knee**2).sum())
        scale = (np.sqrt(np.minimum(1.0, knee / np.maximum(error, 1e-12))) / noise)[:, None]
        rows = np.zeros((len(some.point), 2, len(slope)))
        rows[..., own] = d_camera
        for axis in range(3):
            columns = first + 3 * some.point + axis
            rows[np.arange(len(columns)), :, columns] = d_point[..., axis]
        rows = (rows * scale[..., None]).reshape(-1, len(slope))
        shared += rows.T @ rows
        slope += rows.T @ (residuals * scale).reshape(-1)
    information = np.repeat(1.0 / fixed.std_m**2, 3)
    change = (fixed.points_base_m - scene.base_points_m).reshape(-1)
    diagonal = first + np.arange(information.size)
    shared[diagonal, diagonal] += information
    slope[diagonal] += information * change
    cost += 0.5 * float(np.sum(information * change**2))
    return found._replace(shared=shared, shared_slope=slope, cost=found.cost + cost)


def damped_step(normal: Normal, free: np.ndarray, damping: float) -> tuple[Array, Array]:
    """Levenberg-Marquardt step of shared unknowns (p,) and boards (n, b); NaN when singular.

    Source:
        Triggs, McLauchlan, Hartley, Fitzgibbon 2000, Bundle adjustment, sec. 6.1.
    """
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
    """Covariances of shared unknowns (p, p) and boards (n, b, b), rank, weakest, condition.

    Directions without rank are left out; `weakest` is the least determined one, a unit vector.

    Source:
        Triggs, McLauchlan, Hartley, Fitzgibbon 2000, Bundle adjustment, sec. 6.1.
    """
    boards = normal.boards + 1e-12 * np.eye(normal.boards.shape[1])
    if not free.any():
        nothing = np.zeros(len(free))
        covariance = np.zeros((len(free), len(free)))
        return covariance, np.linalg.inv(boards).astype(np.float64), 0, nothing, 1.0
    cross = normal.cross[:, free]
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
