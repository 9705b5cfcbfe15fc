"""Calibration against truth: views never used, lengths known in mm, two halves of the data."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.bundle_adjustment import Adjustment, Problem, adjust
from freeswing.calib.rig.reprojection import Scene, board_residuals, camera_slices, warped
from freeswing.calib.rig.solve_rig import Rig
from freeswing.calib.rig.triangulation import triangulate
from freeswing.cdpr.rotation import nearest_rotation

LEAST_HALF = 4  # views of each camera: fewer do not fix its lens, and halves differ for that
_VOLUME_POINTS = 200
CHANCE = 0.999
"""Halves that differ by more than so many of those of honest deviations: these are too small."""


@dataclass(frozen=True, slots=True)
class TruthChecks:
    """What the calibration is worth, in pixels and millimetres.

    Attributes:
        held_out_px: error on the half not used, each axis, by camera; NaN without such views.
        length_bias: mean relative error of the board's known lengths, held out; NaN without.
        length_rms_m: rms error of those lengths.
        n_lengths: how many were measured.
        halves_rms_m: rms distance of volume points between the two halves' calibrations.
        halves_shape_rms_m: the same after the best rigid fit.
        volume_std_m: rms of the standard deviation that the covariance gives volume points.
        volume_size_m: extent of the volume that the board was moved through, (3,).
        spread: how many times larger than claimed the lenses' variances are by the two halves; 1
            where that is no more than chance.
    """

    held_out_px: Array
    length_bias: float
    length_rms_m: float
    n_lengths: int
    halves_rms_m: float
    halves_shape_rms_m: float
    volume_std_m: float
    volume_size_m: Array
    spread: float = 1.0


def check_truth(rig: Rig, edges: np.ndarray) -> TruthChecks:
    """Solve both halves of the moments and compare; nothing of the full result is changed.

    Args:
        rig: the full solution.
        edges: pairs of board corners whose distance is known, (m, 2).
    """
    scene, problem = rig.adjustment.scene, rig.problem
    points = _volume_points(scene, problem.board_points_m)
    volume_std = volume_std_m(rig.adjustment, points)
    count = len(scene.cameras)
    nothing = np.full(count, np.nan)
    size = np.ptp(points, axis=0)
    halves = [_half(rig, parity) for parity in (0, 1)]
    if any(half is None for half in halves):
        return TruthChecks(nothing, np.nan, np.nan, 0, np.nan, np.nan, volume_std, size)
    adjusted = [half for half in halves if half is not None]
    solved = [half.scene.cameras for half in adjusted]
    squares, numbers = np.zeros(count), np.zeros(count)
    errors: list[Array] = []
    true: list[Array] = []
    for parity, cameras in enumerate(solved):
        views, _ = problem.views.select(problem.views.piece % 2 != parity).compacted()
        used = replace(problem, views=views)
        held = _held_out(cameras, rig, used, parity)
        for index in range(count):
            residuals = held.residuals_px[views.camera == index]
            squares[index] += float(np.nansum(residuals**2))
            numbers[index] += np.isfinite(residuals).sum()
        measured, known = _lengths(held.scene, used, edges)
        errors.append(measured - known)
        true.append(known)
    with np.errstate(invalid="ignore"):
        held_out = np.sqrt(squares / np.where(numbers > 0, numbers, np.nan))
    error, known = np.concatenate(errors), np.concatenate(true)
    between, shape = _between(solved[0], solved[1], points)
    return TruthChecks(
        held_out_px=held_out,
        length_bias=float(np.mean(error / known)) if error.size else np.nan,
        length_rms_m=float(np.sqrt(np.mean(error**2))) if error.size else np.nan,
        n_lengths=int(error.size),
        halves_rms_m=between,
        halves_shape_rms_m=shape,
        volume_std_m=volume_std,
        volume_size_m=size,
        spread=_spread(adjusted[0], adjusted[1]),
    )


def widened(rig: Rig, truth: TruthChecks) -> tuple[Rig, TruthChecks]:
    """Both with the covariance that the two halves of the footage bear out."""
    if truth.spread == 1.0:
        return rig, truth
    wider = replace(rig.adjustment, covariance=truth.spread * rig.adjustment.covariance)
    scale = float(np.sqrt(truth.spread))
    return replace(rig, adjustment=wider), replace(truth, volume_std_m=scale * truth.volume_std_m)


def _spread(first: Adjustment, second: Adjustment) -> float:
    """Normalised square of the difference between two halves' lenses, over their number."""
    square, count = 0.0, 0
    slices = camera_slices(first.scene.cameras)
    for own, one, other in zip(slices, first.scene.cameras, second.scene.cameras, strict=True):
        lens = slice(own.start, own.start + len(one.params))
        both = first.covariance[lens, lens] + second.covariance[lens, lens]
        apart = one.params - other.params
        square += float(apart @ np.linalg.pinv(both, hermitian=True) @ apart)
        count += len(apart)
    return spread_of(square, count)


def spread_of(square: float, count: int) -> float:
    """Factor of variances that a normalised square of so many numbers asks for, 1 by chance."""
    from scipy.special import gammaincinv

    chance = 2.0 * float(gammaincinv(0.5 * count, CHANCE))
    return square / count if square > chance else 1.0


def _half(rig: Rig, parity: int) -> Adjustment | None:
    """The rig from the moments of one parity alone; None when they are too few."""
    keep = rig.problem.views.piece % 2 == parity
    views, pieces = rig.problem.views.select(keep).compacted()
    per_camera = np.bincount(views.camera, minlength=len(rig.cameras))
    if per_camera.min() < LEAST_HALF:
        return None
    start = rig.adjustment.scene.pieces(pieces)
    problem = replace(rig.problem, views=views)
    return adjust(start, problem, rig.adjustment.sigma_px, rounds=1)


def _held_out(cameras: tuple[Camera, ...], rig: Rig, problem: Problem, parity: int) -> Adjustment:
    """Unused pieces with the cameras of the others: only the board's motion is fitted to them."""
    pieces = np.unique(rig.problem.views.piece)
    scene = rig.adjustment.scene.pieces(pieces[pieces % 2 != parity])
    held = replace(problem, free=np.zeros_like(problem.free))
    return adjust(replace(scene, cameras=cameras), held, rig.adjustment.sigma_px, rounds=1)


def _lengths(scene: Scene, problem: Problem, edges: np.ndarray) -> tuple[Array, Array]:
    """Measured and true lengths of board edges triangulated by two or more cameras."""
    views, cameras = problem.views, scene.cameras
    moments = int(views.moment.max()) + 1
    pixels = np.full((len(cameras), moments, len(problem.board_points_m), 2), np.nan)
    pixels[views.camera, views.moment] = at_moment(scene, problem)
    points = triangulate(cameras, pixels)
    board = warped(problem.board_points_m, scene.warp_m)
    known = np.linalg.norm(board[edges[:, 0]] - board[edges[:, 1]], axis=-1)
    measured = np.linalg.norm(points[:, edges[:, 0]] - points[:, edges[:, 1]], axis=-1)
    seen = np.isfinite(measured)
    return measured[seen], np.broadcast_to(known, measured.shape)[seen]


def at_moment(scene: Scene, problem: Problem) -> Array:
    """Corner pixels carried to an instant common to the moment's views by the board's motion.

    Source:
        plain algebra on Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision,
        sec. 6.1: what the motion moves of a projection, added to the pixel.
    """
    views = problem.views
    if not scene.motion.any():
        return views.pixels
    offsets = np.array([camera.clock_offset_s for camera in scene.cameras])
    own = views.lag_s + offsets[views.camera]
    number = np.bincount(views.moment)
    common = (np.bincount(views.moment, own) / np.maximum(number, 1))[views.moment]
    at_once = tuple(replace(c, clock_offset_s=0.0, line_time_s=0.0) for c in scene.cameras)
    then = replace(views, lag_s=common)
    shown = board_residuals(scene, problem.board_points_m, views)
    moved = board_residuals(replace(scene, cameras=at_once), problem.board_points_m, then)
    return views.pixels + shown - moved


def _volume_points(scene: Scene, board_points_m: Array) -> Array:
    """Points spread over where the board was: its corners at all moments, thinned, (n, 3)."""
    poses = scene.T_base_boards
    placed = board_points_m @ np.swapaxes(poses[:, :3, :3], 1, 2) + poses[:, None, :3, 3]
    flat = placed.reshape(-1, 3)
    flat = flat[np.isfinite(flat[:, 0])]
    return flat[np.unique(np.linspace(0, len(flat) - 1, _VOLUME_POINTS).round().astype(int))]


def _visible(cameras: tuple[Camera, ...], points: Array) -> Array:
    """Pixels of points in every camera, NaN where outside, (n_cameras, n_points, 2)."""
    in_camera = [camera.to_camera(points) for camera in cameras]
    return np.stack(
        [
            np.where(camera.sees(p)[:, None], camera.project(p), np.nan)
            for camera, p in zip(cameras, in_camera, strict=True)
        ]
    )


def _between(
    first: tuple[Camera, ...], second: tuple[Camera, ...], points: Array
) -> tuple[float, float]:
    """Rms distance of points seen by one rig and triangulated by the other; and its shape part."""
    again = triangulate(second, _visible(first, points))
    good = np.isfinite(again[:, 0])
    if good.sum() < 4:
        return np.nan, np.nan
    a, b = points[good], again[good]
    rms = float(np.sqrt(np.mean(np.sum((b - a) ** 2, axis=1))))
    shape = b - rigidly_fitted(a, b)
    return rms, float(np.sqrt(np.mean(np.sum(shape**2, axis=1))))


def rigidly_fitted(source: Array, target: Array) -> Array:
    """Source points turned and shifted onto the target with least squares, (n, 3).

    Source:
        Kabsch 1976, A solution for the best rotation to relate two sets of vectors.
    """
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    return np.asarray(a @ nearest_rotation(a.T @ b) + target.mean(axis=0))


def volume_std_m(result: Adjustment, points: Array) -> float:
    """Rms standard deviation of points triangulated by the rig, from its covariance alone.

    A point X seen by several cameras moves with their unknowns theta by
    dX = -(A' A)^-1 A' B dtheta, A and B the pixels' derivatives by X and theta.
    """
    cameras = result.scene.cameras
    slices = camera_slices(cameras)
    p = slices[-1].stop
    normal = np.zeros((len(points), 3, 3))
    mixed = np.zeros((len(points), 3, p))
    views = np.zeros(len(points), dtype=int)
    for camera, own, sigma in zip(cameras, slices, result.sigma_px, strict=True):
        in_camera = camera.to_camera(points)
        sees = camera.sees(in_camera)
        arm = in_camera - camera.T_camera_base[:3, 3]
        _, d_point, d_params = camera.project_jacobian(in_camera)
        a = d_point @ camera.T_camera_base[:3, :3] / sigma
        turned = np.cross(arm[:, None, :], d_point)
        b = np.concatenate([d_params, d_point, turned], axis=-1) / sigma
        a, b = (np.where(sees[:, None, None], array, 0.0) for array in (a, b))
        normal += np.swapaxes(a, 1, 2) @ a
        mixed[..., own.start : own.stop - 2] += np.swapaxes(a, 1, 2) @ b
        views += sees
    good = (views >= 2) & (np.linalg.cond(normal + 1e-300 * np.eye(3)) < 1e12)
    if not good.any():
        return float("nan")
    gain = np.linalg.solve(normal[good], mixed[good])
    covariance = gain @ result.covariance[:p, :p] @ np.swapaxes(gain, 1, 2)
    return float(np.sqrt(np.mean(np.trace(covariance, axis1=1, axis2=2))))
