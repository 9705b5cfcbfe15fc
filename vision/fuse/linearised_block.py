"""A block's sightings about the poses: residuals and their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.fuse.pose_kernels import linearise_block
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import Block, CameraViews

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Linear:
    """Of each sighting, rows of markers filled as far as they go.

    Attributes:
        residuals: measured minus predicted rays, (n_o, 8).
        jacobians: of the prediction by position and small rotation, (n_o, 8, 6).
        rates: of the prediction by time, (n_o, 8).
        places: points in the camera's frame, (n_o, 4, 3).
    """

    residuals: Array
    jacobians: Array
    rates: Array
    places: Array


def linearised(block: Block, views: Sequence[CameraViews], poses: Poses) -> Linear:
    """At a run's poses, each point carried to its own time by the motion."""
    span = slice(block.first, block.first + len(block.starts) - 1)
    return linearised_at(
        block,
        views,
        np.ascontiguousarray(poses.rotations[span]),
        np.ascontiguousarray(poses.positions_m[span]),
        poses.known[span],
        np.ascontiguousarray(poses.motions[span]),
        lags(block, poses.times_s[span]),
    )


def linearised_at(
    block: Block,
    views: Sequence[CameraViews],
    rotations: Array,
    positions_m: Array,
    known: Mask,
    motions: Array,
    lags_s: Array,
) -> Linear:
    """At poses of the block's instants: (m, 3, 3), (m, 3), (m,), (m, 6) and lags (n_o, 4)."""
    n_o = len(block.things)
    found = Linear(
        np.zeros((n_o, 8)), np.zeros((n_o, 8, 6)), np.zeros((n_o, 8)), np.ones((n_o, 4, 3))
    )
    linearise_block(
        block.starts,
        rotations,
        positions_m,
        known,
        motions,
        camera_matrices(views),
        block.camera_of,
        block.points,
        block.rays,
        lags_s,
        block.counts,
        found.residuals,
        found.jacobians,
        found.rates,
        found.places,
    )
    return found


def lags(block: Block, instants_s: Array) -> Array:
    """How long after its instant each point was seen, (n_o, 4)."""
    instant = np.repeat(np.arange(len(instants_s)), np.diff(block.starts))
    return np.ascontiguousarray(block.times_s - instants_s[instant][:, None])


def camera_matrices(views: Sequence[CameraViews]) -> Array:
    """T_camera_base of all cameras, (n_c, 4, 4)."""
    return np.array([view.camera.T_camera_base for view in views])
