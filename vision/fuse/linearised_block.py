"""A block's sightings about the poses: residuals and their derivatives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.fuse.pose_kernels import BelievedPoses, Linear, Seen, linearise_block
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import Block, CameraViews

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def linearised(block: Block, views: Sequence[CameraViews], poses: Poses) -> Linear:
    """At a run's poses, each point carried to its own time by the motion."""
    span = slice(block.first, block.first + len(block.starts) - 1)
    found = block_poses(poses.rotations[span], poses.positions_m[span], poses.known[span])
    return linearise_block(seen_by(block, views), found)


def seen_by(block: Block, views: Sequence[CameraViews]) -> Seen:
    """The block's sightings as the kernels take them."""
    return Seen(
        block.starts,
        camera_matrices(views),
        block.camera_of,
        block.points,
        block.rays,
        np.ascontiguousarray(block.times_s - block.sighted_s()[:, None]),
        block.counts,
        block.shifts,
        block.motions,
    )


def block_poses(rotations: Array, positions_m: Array, known: Mask) -> BelievedPoses:
    """Poses of a block's instants as the kernels take them: (m, 3, 3), (m, 3), (m,)."""
    return BelievedPoses(np.ascontiguousarray(rotations), np.ascontiguousarray(positions_m), known)


def camera_matrices(views: Sequence[CameraViews]) -> Array:
    """T_camera_base of all cameras, (n_c, 4, 4)."""
    return np.array([view.camera.T_camera_base for view in views])
