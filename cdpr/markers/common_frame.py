"""What all runs' poses have wrong together because the markers lie otherwise than target.toml says.

The session's layout is laid on target.toml's; what that leaves open of the platform's frame moves
and turns the poses of all runs alike, which no comparison of runs shows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.measured.pose_errors import TERMS, PoseErrors
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.cdpr.rotation import matrix_from_angles, skew

Array = NDArray[np.float64]

_CONSTANT, _TURNS = 0, slice(4, 7)  # among the terms of `PoseErrors`


def common_frame(covariance: Array, trajectory: Trajectory) -> PoseErrors:
    """Six independent modes of an error of the platform frame, in the poses of one run.

    Args:
        covariance: of a small shift in m and rotation vector in rad, platform frame, (6, 6).
        trajectory: full poses, some of them known.

    Source:
        Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, ch. 2: errors
        of a frame as small screws.
    """
    known = trajectory.values[trajectory.is_known]
    places = [trajectory.coordinates.index(name) for name in POSE_COORDINATES]
    zetas = known[:, places]
    left, _, right = np.linalg.svd(matrix_from_angles(zetas[:, 3:]).sum(axis=0))
    about = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    modes = np.zeros((6, 6, TERMS))
    for mode, cause in zip(modes, np.linalg.cholesky(covariance).T, strict=True):
        for rows, vector in ((slice(0, 3), cause[:3]), (slice(3, 6), cause[3:])):
            there = about @ vector
            mode[rows, _CONSTANT] = there
            mode[rows, _TURNS] = -skew(there)
    return PoseErrors(zetas[:, :3].mean(axis=0), about, modes)
