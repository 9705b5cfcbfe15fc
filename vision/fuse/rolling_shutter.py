"""What a rolling shutter does to a tag's fitted corners.

The rows of a tag are seen one after the other, so a tag that turns meanwhile looks bent: time times
velocity is a quadratic in the image, and the pattern fit takes the homography nearest to it. That
homography's corners are not where the corners were seen: for a tag of n rows by about
line time * n^2 / 6 * turning rate, in pixels. The difference follows from the motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.fuse.pose_kernels import Linear
from freeswing.vision.fuse.run_views import Block, CameraViews

Array = NDArray[np.float64]

_INTERVALS = 16  # edges lie all over a tag, its border counts most
_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
"""TL TR BR BL: to the right, downwards."""


def rolling_bias(block: Block, views: Sequence[CameraViews], linear: Linear) -> Array:
    """What it adds to the rays of a block's sightings about their poses, (n_o, 8)."""
    rolling = np.array([view.camera.line_time_s != 0.0 for view in views])
    mine = (block.counts == 4) & rolling[block.camera_of] & np.any(linear.rates != 0.0, axis=1)
    bias = np.zeros_like(block.rays)
    if mine.any():
        corners = (block.rays - linear.residuals)[mine].reshape(-1, 4, 2)
        found = corner_bias(corners, linear.rates[mine].reshape(-1, 4, 2), block.times_s[mine])
        bias[mine] = found.reshape(-1, 8)
    return bias


def corner_bias(corners: Array, velocities: Array, times_s: Array) -> Array:
    """Fitted minus seen corners of tags that move while they are read.

    Args:
        corners: TL TR BR BL in undistorted coordinates, (n, 4, 2).
        velocities: of these, (n, 4, 2).
        times_s: when each corner was seen, (n, 4).

    Source:
        Press et al. 2007, Numerical Recipes, sec. 15.4: the nearest parallelogram by least
        squares.
    """
    inside, nearest = _pattern()
    since = times_s - times_s.mean(axis=1, keepdims=True)
    bent = (inside @ since[..., None]) * (inside @ velocities)
    right = 0.5 * (corners[:, 1] - corners[:, 0] + corners[:, 2] - corners[:, 3])
    down = 0.5 * (corners[:, 3] - corners[:, 0] + corners[:, 2] - corners[:, 1])
    axes = np.stack([right, down], axis=-1)
    own = np.swapaxes(np.linalg.solve(axes, np.swapaxes(bent, 1, 2)), 1, 2)
    fitted = (own.reshape(len(corners), -1) @ nearest.T).reshape(-1, 4, 2)
    return fitted @ np.swapaxes(axes, 1, 2) - since[..., None] * velocities


@cache
def _pattern() -> tuple[Array, Array]:
    """Weights of the corners at points of the tag (k, 4); nearest homography at them (8, 2 k)."""
    line = np.arange(_INTERVALS + 1) / _INTERVALS
    points = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    a, b = points.T
    inside = np.stack([(1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b], axis=1)
    nearest = _homographies(_CORNERS) @ np.linalg.pinv(_homographies(points))
    return inside, nearest


def _homographies(points: Array) -> Array:
    """Small homographies' displacements of points (k, 2), (2 k, 8)."""
    a, b = points.T
    one, zero = np.ones_like(a), np.zeros_like(a)
    rows = [
        [one, a, b, zero, zero, zero, a * a, a * b],
        [zero, zero, zero, one, a, b, a * b, b * b],
    ]
    return np.array(rows).transpose(2, 0, 1).reshape(-1, 8)
