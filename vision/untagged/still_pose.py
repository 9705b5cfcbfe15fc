"""The platform's pose in images of it at rest, from points whose places on it are known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.rotation import transform
from freeswing.vision.fuse.pose_kernels import (
    MOST_PASSES,
    ROBUST_LIMIT,
    BelievedPose,
    Seen,
    solve_instant,
)
from freeswing.vision.look.single_pose import whitening

Array = NDArray[np.float64]


def still_pose(
    cameras: Sequence[Camera],
    camera_of: NDArray[np.int64],
    points_m: Array,
    pixels: Array,
    std_px: Array,
    start: Array,
) -> tuple[Array, Array]:
    """T_base_platform (4, 4) of all sightings at once, and its covariance (6, 6).

    Args:
        cameras: as calibrated.
        camera_of: camera of each sighting, (n,).
        points_m: platform frame, (n, 3).
        pixels: (n, 2).
        std_px: deviation of each, (n,).
        start: T_base_platform to start from, (4, 4).

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, appendix 6:
        Gauss-Newton on the reprojection error.
    """
    count = len(pixels)
    points, rays = np.zeros((count, 4, 3)), np.zeros((count, 8))
    points[:, 0] = points_m
    for index, camera in enumerate(cameras):
        own = camera_of == index
        rays[own, :2] = camera.normalise(pixels[own])
    focal = np.array([camera.focal_px.mean() for camera in cameras])[camera_of]
    covariance = np.tile(np.eye(8), (count, 1, 1))
    covariance[:, [0, 1], [0, 1]] = (std_px / focal)[:, None] ** 2
    seen = Seen(
        np.array([0, count]),
        np.array([camera.T_camera_base for camera in cameras]),
        np.asarray(camera_of, dtype=np.int64),
        points,
        rays,
        np.zeros((count, 4)),
        np.ones(count, dtype=np.int64),
        np.zeros((count, 6)),
        np.zeros((count, 12)),
    )
    begun = BelievedPose(start[:3, :3].copy(), start[:3, 3].copy())
    solved = solve_instant(
        seen, whitening(covariance), 0, begun, 6, ROBUST_LIMIT, np.int64(MOST_PASSES)
    )
    return transform(solved.rotation, solved.position), solved.covariance
