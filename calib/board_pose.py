"""Pose of a rigid board in one calibrated camera: every view on its own, all views at once."""

from __future__ import annotations

import numpy as np

from calib.camera import Camera
from calib.camera_models import Array
from calib.planar_pose import board_poses, flipped
from cdpr.rotation import exp_rotation

_STEPS = 12
_START_DAMPING = 1e-3
_SMALL_STEP = 1e-9


def best_poses(camera: Camera, points_m: Array, pixels: Array) -> Array:
    """Poses T_camera_board, each the better of the two that a plane allows, (n, 4, 4).

    Args:
        camera: its lens is used, its pose is not.
        points_m: corners of a planar board, (n_points, 3).
        pixels: views, NaN where unseen, (n, n_points, 2).

    Returns:
        NaN for views that determine no pose.
    """
    first = board_poses(camera, points_m[:, :2], pixels)
    known = np.isfinite(first[:, 0, 0])
    result = np.full_like(first, np.nan)
    if not known.any():
        return result
    options = np.stack(
        [
            polished(camera, points_m, o, pixels[known])
            for o in (first[known], flipped(first[known]))
        ]
    )
    errors = np.stack([view_errors(camera, points_m, o, pixels[known]) for o in options])
    pick = np.nan_to_num(errors, nan=np.inf).argmin(axis=0)
    chosen = options[pick, np.arange(len(pick))]
    behind = ~np.isfinite(errors.min(axis=0))
    chosen[behind] = np.nan
    result[known] = chosen
    return result


def polished(camera: Camera, points_m: Array, poses: Array, pixels: Array) -> Array:
    """Poses refined to least reprojection error, damped Gauss-Newton, (n, 4, 4)."""
    poses = np.array(poses)
    damping = np.full(len(poses), _START_DAMPING)
    errors = view_errors(camera, points_m, poses, pixels)
    seen = np.isfinite(pixels[..., 0])
    for _ in range(_STEPS):
        arm = points_m @ np.swapaxes(poses[:, :3, :3], 1, 2)
        predicted, d_point, _ = camera.project_jacobian(arm + poses[:, None, :3, 3])
        rotation = np.cross(arm[..., None, :], d_point)
        rows = np.where(seen[..., None, None], np.concatenate([d_point, rotation], -1), 0.0)
        rows = rows.reshape(len(poses), -1, 6)
        residual = np.where(seen[..., None], pixels - predicted, 0.0).reshape(len(poses), -1, 1)
        usable = np.isfinite(rows).all(axis=(1, 2)) & np.isfinite(residual).all(axis=(1, 2))
        rows[~usable], residual[~usable] = 0.0, 0.0
        normal = np.swapaxes(rows, 1, 2) @ rows
        diagonal = np.einsum("nii->ni", normal)
        diagonal += damping[:, None] * diagonal + 1e-9
        step = np.linalg.solve(normal, np.swapaxes(rows, 1, 2) @ residual)[..., 0]
        trial = np.array(poses)
        trial[:, :3, 3] += step[:, :3]
        trial[:, :3, :3] = exp_rotation(step[:, 3:]) @ poses[:, :3, :3]
        trial_errors = view_errors(camera, points_m, trial, pixels)
        better = trial_errors <= errors
        poses[better], errors[better] = trial[better], trial_errors[better]
        damping = np.where(better, damping * 0.1, damping * 10.0)
        if np.abs(step).max() < _SMALL_STEP:
            break
    return poses


def view_errors(camera: Camera, points_m: Array, poses: Array, pixels: Array) -> Array:
    """Rms reprojection error of each view, each axis, (n,); infinite where a corner is behind."""
    points = points_m @ np.swapaxes(poses[:, :3, :3], 1, 2) + poses[:, None, :3, 3]
    squares = np.sum((pixels - camera.project(points)) ** 2, axis=-1)
    seen = np.isfinite(pixels[..., 0])
    squares = np.where(np.isfinite(squares), squares, np.inf)
    total = np.where(seen, squares, 0.0).sum(axis=1)
    return np.sqrt(total / np.maximum(2 * seen.sum(axis=1), 1))
