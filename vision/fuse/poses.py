"""The platform's poses along a run."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.fuse.motion.motion_from_poses import Course, course_of

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Poses:
    """The platform at the instants of a run.

    Attributes:
        times_s: base time, (n,).
        positions_m: NaN where unknown, (n, 3).
        rotations: R_base_platform, (n, 3, 3).
        covariances: of position and small rotation in the base frame, (n, 6, 6), or none (0, 6, 6).
        known: (n,).
        motions: velocity, angular velocity, and their rates in the base frame, (n, 12).
        course: the motion between them, None where fewer than two are known.
    """

    times_s: Array
    positions_m: Array
    rotations: Array
    covariances: Array
    known: Mask
    motions: Array
    course: Course | None = None


def unknown_poses(instants_s: Array) -> Poses:
    """Nothing known yet at some instants, (n,)."""
    n = len(instants_s)
    return Poses(
        instants_s,
        np.full((n, 3), np.nan),
        np.full((n, 3, 3), np.nan),
        np.zeros((0, 6, 6)),
        np.zeros(n, dtype=bool),
        np.zeros((n, 12)),
    )


def with_course(poses: Poses, deviations: Array, before: Course | None = None) -> Poses:
    """Poses with the motion that they make.

    Args:
        poses: without.
        deviations: of position and small rotation, zero where these are not sought, (6,).
        before: a motion of nearly the same poses.
    """
    spectrum = None if before is None else before.spectrum
    course = course_of(
        poses.times_s, poses.positions_m, poses.rotations, poses.known, deviations, spectrum
    )
    return replace(poses, course=course)


def motions_of(poses: Poses) -> Array:
    """Velocity, angular velocity and their rates at the instants, zero where unknown, (n, 12).

    Source:
        Rasmussen, Williams 2006, Gaussian Processes for Machine Learning, sec. 9.4: slopes.
    """
    n = len(poses.times_s)
    if poses.course is None:
        return np.zeros((n, 12))
    return poses.course.carried(np.arange(n), np.zeros(n)).motions * poses.known[:, None]
