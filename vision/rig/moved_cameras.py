"""Cameras that were knocked, by base tags that are not where their calibration puts them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.rotation import exp_rotation
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.look.watched_target import Watch

Array = NDArray[np.float64]

# Base tags are averaged over all frames: what is left of their corners' noise is below 0.05 px, and
# surveys good to 0.3 mm are 0.1 to 0.3 px. More is a camera that was knocked.
MOVED_PX = 0.4


def base_tag_rays(views: CameraViews, watch: Watch) -> tuple[Array, Array, Array, Array]:
    """Mean base-tag corners over a run.

    Returns:
        Rays (n, 8), frames (n,), base corners (n, 4, 3), and stated deviations of these, NaN where
        none is, (n,).

    Source:
        Press et al. 2007, Numerical Recipes, sec. 14.1: means.
    """
    sums: dict[int, Array] = {}
    counts: dict[int, int] = {}
    for _, piece in views.pieces():
        mine = (piece.things >= watch.first_base) & (piece.things < watch.first_marker)
        for thing, rays in zip(piece.things[mine], piece.rays[mine], strict=True):
            sums[int(thing)] = sums.get(int(thing), np.zeros(8)) + rays
            counts[int(thing)] = counts.get(int(thing), 0) + 1
    things = sorted(sums)
    which = np.array([t - watch.first_base for t in things], dtype=np.int64)
    corners = watch.base_corners_m[which].reshape(-1, 4, 3)
    stated = watch.base_std_m if len(watch.base_std_m) else np.full(len(watch.base_tags), np.nan)
    measured = np.array([sums[t] / counts[t] for t in things]).reshape(-1, 8)
    return measured, np.array([counts[t] for t in things]), corners, stated[which]


def base_tag_misses(views: CameraViews, watch: Watch) -> tuple[Array, Array, Array, Array]:
    """Mean base-tag corners against their calibrated places.

    Returns:
        Residual rays (n, 8), the others as `base_tag_rays`.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 6.1.
    """
    measured, counts, corners, stated_m = base_tag_rays(views, watch)
    seen = views.camera.to_camera(corners)
    predicted = (seen[..., :2] / seen[..., 2:]).reshape(-1, 8)
    return measured - predicted, counts, corners, stated_m


def moved_cameras(views: Sequence[CameraViews], watch: Watch) -> dict[int, float]:
    """Cameras whose base tags lie more than `MOVED_PX` off, with the median miss in pixels."""
    moved = {}
    for index, view in enumerate(views):
        misses, counts, *_ = base_tag_misses(view, watch)
        if not len(counts):
            continue
        sizes = np.linalg.norm(misses.reshape(-1, 2), axis=1) * view.camera.focal_px.mean()
        if was_moved(sizes):
            moved[index] = float(np.median(sizes))
    return moved


def was_moved(misses_px: Array) -> bool:
    """Whether base tags lie too far off: their median, for one of them may have been bumped."""
    return bool(np.median(misses_px) > MOVED_PX)


def repose_by_base_tags(view: CameraViews, watch: Watch, survey_std_m: float) -> Camera:
    """The camera's pose by its base tags alone: a start, good to some milliradians."""
    camera = view.camera
    for _ in range(10):
        normal, right = base_equations(view.believed(camera), watch, survey_std_m)
        normal = normal + np.diag([1e2**2] * 3 + [1e-6] * 3)  # a knock turns more than it shifts
        step = np.asarray(np.linalg.solve(normal, right), dtype=np.float64)
        camera = moved_by(camera, step)
        if np.abs(step).max() < 1e-9:
            break
    return camera


def base_equations(view: CameraViews, watch: Watch, survey_std_m: float) -> tuple[Array, Array]:
    """Normal matrix (6, 6) and right side (6,) of a camera's pose change by its base tags.

    A tag counts as its stated deviation has it, `survey_std_m` serves where none is stated.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, appendix 6:
        normal equations of a camera's pose.
    """
    misses, _, corners, stated_m = base_tag_misses(view, watch)
    own_m = np.where(np.isnan(stated_m), survey_std_m, stated_m)
    focal = view.camera.focal_px.mean()
    normal, right = np.zeros((6, 6)), np.zeros(6)
    offset = view.camera.T_camera_base[:3, 3]
    for miss, corner, tag_m in zip(misses, corners, own_m, strict=True):
        seen = view.camera.to_camera(corner)
        sizes = np.linalg.norm(miss.reshape(4, 2), axis=1) * focal
        if np.median(sizes) > 200.0:
            continue
        for k, place in enumerate(seen):
            x, y = place[:2] / place[2]
            g = np.array([[1.0, 0.0, -x], [0.0, 1.0, -y]]) / place[2]
            arm = place - offset
            jacobian = np.hstack([g, np.cross(arm, g)])
            std = np.hypot(tag_m / place[2], 0.02 / focal)
            normal += jacobian.T @ jacobian / std**2
            right += jacobian.T @ miss[2 * k : 2 * k + 2] / std**2
    return normal, right


def moved_by(camera: Camera, step: Array) -> Camera:
    """The camera after a change of pose (dt, dr)."""
    pose = camera.T_camera_base.copy()
    pose[:3, :3] = exp_rotation(step[3:]) @ pose[:3, :3]
    pose[:3, 3] = pose[:3, 3] + step[:3]
    return replace(camera, T_camera_base=pose)
