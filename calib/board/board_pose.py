"""Pose of a rigid board in one calibrated camera: every view on its own, all views at once."""

from __future__ import annotations

import numpy as np

from freeswing.calib.board.planar_pose import board_poses, flipped
from freeswing.calib.board.pose_kernels import polish_poses
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import FISHEYE, Array, full_parameters

_STEPS = 12


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
    lens = (camera.model == FISHEYE, full_parameters(camera.model, camera.params))
    views = np.ascontiguousarray(pixels[known])
    options = np.stack([first[known], flipped(first[known])])
    errors = np.stack([polish_poses(*lens, points_m, views, option, _STEPS) for option in options])
    pick = errors.argmin(axis=0)
    chosen = options[pick, np.arange(len(pick))]
    chosen[np.isinf(errors.min(axis=0))] = np.nan
    result[known] = chosen
    return result


def view_errors(camera: Camera, points_m: Array, poses: Array, pixels: Array) -> Array:
    """Rms reprojection error of each view, each axis, (n,); infinite where a corner is behind.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 4.2.3:
        reprojection error.
    """
    points = points_m @ np.swapaxes(poses[:, :3, :3], 1, 2) + poses[:, None, :3, 3]
    squares = np.sum((pixels - camera.project(points)) ** 2, axis=-1)
    seen = np.isfinite(pixels[..., 0])
    squares = np.where(np.isfinite(squares), squares, np.inf)
    total = np.where(seen, squares, 0.0).sum(axis=1)
    return np.sqrt(total / np.maximum(2 * seen.sum(axis=1), 1))
