"""A block's sightings about the poses: residuals and their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vision.pose_kernels import linearise_block

if TYPE_CHECKING:
    from vision.poses import Poses
    from vision.run_views import Block, CameraViews

Array = NDArray[np.float64]


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
    count, n_o = len(block.starts) - 1, len(block.things)
    span = slice(block.first, block.first + count)
    instant = np.repeat(np.arange(count), np.diff(block.starts))
    lags = np.ascontiguousarray(block.times_s - poses.times_s[span][instant][:, None])
    found = Linear(
        np.zeros((n_o, 8)), np.zeros((n_o, 8, 6)), np.zeros((n_o, 8)), np.ones((n_o, 4, 3))
    )
    linearise_block(
        block.starts,
        np.ascontiguousarray(poses.rotations[span]),
        np.ascontiguousarray(poses.positions_m[span]),
        poses.known[span],
        np.ascontiguousarray(poses.motions[span]),
        np.array([view.camera.T_camera_base for view in views]),
        block.camera_of,
        block.points,
        block.rays,
        lags,
        block.counts,
        found.residuals,
        found.jacobians,
        found.rates,
        found.places,
    )
    return found
