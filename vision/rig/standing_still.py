"""Platforms that stand still tell no clock: their poses move by noise alone."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.cdpr.rotation import log_rotation
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.rig.clock_rates import Rates
from freeswing.vision.rig.rig_kernels import PER_CAMERA
from freeswing.vision.rig.rig_step import RigStep

# Noise without memory gives 2, give or take 0.2 in twenty frames; a swing that frames follow gives
# a few hundredths, and 1 where it is as fast as a sixth of their rate.
NO_COURSE = 1.5
# Deviations that poses claim are good to some ten percent: what moves by three of them does move.
AT_THE_NOISE = 3.0


def stands_still(poses: Poses) -> bool:
    """Whether poses neither follow a course from frame to frame nor leave their noise.

    Args:
        poses: some known, with their covariances.

    Source:
        von Neumann 1941, Distribution of the Ratio of the Mean Square Successive Difference to the
        Variance.
    """
    known = poses.known
    turns = log_rotation(poses.rotations[known] @ poses.rotations[known][0].T)
    off = np.column_stack([poses.positions_m[known], turns])
    power = np.var(off, axis=0)
    noise = np.mean(np.diagonal(poses.covariances[known], axis1=1, axis2=2), axis=0)
    sought = (noise > 0.0) & (power > 0.0)
    if not sought.any():
        return False
    course = np.mean(np.diff(off, axis=0) ** 2, axis=0)[sought] / power[sought]
    size = np.sqrt(power[sought] / noise[sought])
    return bool(course.mean() > NO_COURSE and size.max() < AT_THE_NOISE)


def nothing_asked(n_c: int) -> tuple[Array, Array, RigStep, Array, Rates]:
    """No change of clock or line time, no jitter and no rate of so many cameras."""
    none = np.zeros(n_c)
    places = np.zeros((n_c, PER_CAMERA))
    step = RigStep(places, places, np.zeros((places.size, places.size)))
    return none, none, step, none, Rates(none, none, 0.0, 0.0)
