"""Poses of the platform in one camera's frame: a first one, its refinement and its motion."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.elimination import inverse_factors
from freeswing.cdpr.rotation import exp_rotation
from freeswing.vision.fuse.pose_kernels import ROBUST_LIMIT
from freeswing.vision.look.near_kernels import carried_on, refined_pose

Array = NDArray[np.float64]
Pose = tuple[Array, Array]
"""R_camera_platform (3, 3) and the platform's origin in the camera frame (3,)."""

_PASSES = 10


def start_pose(points: Array, rays: Array) -> Pose | None:
    """Pose from tags alone: points (n, 4, 3), rays (n, 8); None when it cannot be had.

    One tag has two poses that look alike: the one that fits better is taken.
    """
    flat, image = points.reshape(-1, 3), rays.reshape(-1, 1, 2)
    best: tuple[float, Pose] | None = None
    methods = (cv2.SOLVEPNP_SQPNP, cv2.SOLVEPNP_IPPE) if len(points) == 1 else (cv2.SOLVEPNP_SQPNP,)
    for method in methods:
        try:
            _, turns, shifts, _ = cv2.solvePnPGeneric(flat, image, np.eye(3), None, flags=method)
        except cv2.error:
            continue
        for turn, shift in zip(turns, shifts, strict=True):
            rotation = np.asarray(exp_rotation(np.ravel(turn)))
            position = np.ravel(shift).astype(np.float64)
            seen = flat @ rotation.T + position
            if (seen[:, 2] <= 0.0).any():
                continue
            error = float(np.sum((seen[:, :2] / seen[:, 2:] - image[:, 0]) ** 2))
            if best is None or error < best[0]:
                best = (error, (rotation, position))
    return None if best is None else best[1]


def whitening(covariances: Array) -> Array:
    """W with W'W the inverse of each covariance, (n, m, m).

    Source:
        Golub, Van Loan 2013, Matrix Computations, sec. 4.2: the Cholesky factor.
    """
    return inverse_factors(np.ascontiguousarray(covariances, dtype=np.float64))


def refine_pose(start: Pose, points: Array, rays: Array, covariances: Array) -> Pose | None:
    """Least squares over all tags of one image; None when it does not determine a pose."""
    known, rotation, position = refined_pose(
        np.ascontiguousarray(points),
        np.ascontiguousarray(rays),
        np.ascontiguousarray(covariances),
        start[0],
        start[1],
        ROBUST_LIMIT,
        _PASSES,
    )
    return (rotation, position) if known else None


def extrapolate(past: Sequence[tuple[float, Pose]], time_s: float) -> Pose | None:
    """The pose at `time_s` by constant acceleration through the last three, or what there is."""
    if not past:
        return None
    return carried_on(
        np.array([t for t, _ in past]),
        np.array([rotation for _, (rotation, _) in past]),
        np.array([position for _, (_, position) in past]),
        time_s,
    )


def lagrange(times: Array, time_s: float) -> Array:
    """Weights of the polynomial through samples at `times`, read at `time_s`.

    Source:
        Press et al. 2007, Numerical Recipes, sec. 3.2.
    """
    weights = np.ones(len(times))
    for i in range(len(times)):
        for j in range(len(times)):
            if i != j:
                weights[i] *= (time_s - times[j]) / (times[i] - times[j])
    return weights
