"""Points in space from their pixels in several calibrated cameras."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import Array

_STEPS = 5
_LEAST_ANGLE_RAD = 0.01  # on flatter rays depth is a hundred times worse than width
_LEAST_CURVATURE = 1e-12


def triangulate(cameras: Sequence[Camera], pixels: Array) -> Array:
    """Base-frame points of least reprojection error, (..., 3); NaN with fewer than two rays.

    A linear intersection of the rays is refined by Gauss-Newton on the pixels.

    Args:
        cameras: the rig, n of them.
        pixels: where each camera sees the points, NaN where it does not, (n, ..., 2).

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, ch. 12.
    """
    flat = np.reshape(pixels, (len(cameras), -1, 2))
    points = _intersect_rays(cameras, flat)
    for _ in range(_STEPS):
        normal, slope = _normal(cameras, points, flat)
        known = np.isfinite(normal.sum(axis=(1, 2)))
        safe = np.where(known[:, None, None], normal, np.eye(3))
        values = np.linalg.eigvalsh(safe)
        solvable = known & (values[:, 0] > _LEAST_CURVATURE * values[:, 2])
        safe = np.where(solvable[:, None, None], normal, np.eye(3))
        step = np.linalg.solve(safe, slope[..., None])[..., 0]
        points = np.where(solvable[:, None], points + step, np.nan)
    return points.reshape(*np.shape(pixels)[1:-1], 3)


def _intersect_rays(cameras: Sequence[Camera], pixels: Array) -> Array:
    """Points nearest to all rays in the least-squares sense, (n_points, 3)."""
    count = pixels.shape[1]
    normal, right = np.zeros((count, 3, 3)), np.zeros((count, 3))
    rays_seen = np.zeros(count, dtype=int)
    for camera, seen in zip(cameras, pixels, strict=True):
        rays = np.concatenate([camera.normalise(seen), np.ones((count, 1))], axis=1)
        good = np.isfinite(rays[:, 0])
        direction = rays[good] @ camera.T_camera_base[:3, :3]
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        across = np.eye(3) - direction[:, :, None] * direction[:, None, :]
        normal[good] += across
        right[good] += across @ camera.position_base_m
        rays_seen += good
    solvable = (rays_seen >= 2) & (np.linalg.eigvalsh(normal)[:, 0] > _LEAST_ANGLE_RAD**2)
    safe = np.where(solvable[:, None, None], normal, np.eye(3))
    points = np.linalg.solve(safe, right[..., None])[..., 0]
    return np.where(solvable[:, None], points, np.nan)


def _normal(cameras: Sequence[Camera], points: Array, pixels: Array) -> tuple[Array, Array]:
    normal, slope = np.zeros((len(points), 3, 3)), np.zeros((len(points), 3))
    for camera, seen in zip(cameras, pixels, strict=True):
        predicted, d_point, _ = camera.project_jacobian(camera.to_camera(points))
        d_base = d_point @ camera.T_camera_base[:3, :3]
        known = np.isfinite(seen[:, 0])
        d_base = np.where(known[:, None, None], d_base, 0.0)
        residual = np.where(known[:, None], seen - predicted, 0.0)
        d_base_t = np.swapaxes(d_base, 1, 2)
        normal += d_base_t @ d_base
        slope += (d_base_t @ residual[..., None])[..., 0]
    return normal, slope
