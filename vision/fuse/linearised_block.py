"""A block's sightings about the poses: residuals and their derivatives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.fuse.pose_kernels import Linear, MovingPoses, Seen, linearise_block
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import Block, CameraViews

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def linearised(block: Block, views: Sequence[CameraViews], poses: Poses) -> Linear:
    """At a run's poses, each point carried to its own time by the motion."""
    span = slice(block.first, block.first + len(block.starts) - 1)
    seen = seen_by(block, views, lags(block, poses.times_s[span]))
    found = block_poses(
        poses.rotations[span], poses.positions_m[span], poses.known[span], poses.motions[span]
    )
    return linearise_block(seen, found)


def seen_by(block: Block, views: Sequence[CameraViews], lags_s: Array) -> Seen:
    """The block's sightings as the kernels take them, with the points' lags (n_o, 4)."""
    return Seen(
        block.starts,
        camera_matrices(views),
        block.camera_of,
        block.points,
        block.rays,
        lags_s,
        block.counts,
    )


def block_poses(rotations: Array, positions_m: Array, known: Mask, motions: Array) -> MovingPoses:
    """Poses of a block's instants as the kernels take them: (m, 3, 3), (m, 3), (m,), (m, 12)."""
    return MovingPoses(
        np.ascontiguousarray(rotations),
        np.ascontiguousarray(positions_m),
        known,
        np.ascontiguousarray(motions),
    )


def lags(block: Block, instants_s: Array) -> Array:
    """How long after its instant each point was seen, (n_o, 4)."""
    instant = np.repeat(np.arange(len(instants_s)), np.diff(block.starts))
    return np.ascontiguousarray(block.times_s - instants_s[instant][:, None])


def camera_matrices(views: Sequence[CameraViews]) -> Array:
    """T_camera_base of all cameras, (n_c, 4, 4)."""
    return np.array([view.camera.T_camera_base for view in views])
