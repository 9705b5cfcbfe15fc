"""Stamps that all cameras have wrong alike, or one camera alone, as far as the motion tells.

Even stamps, made of a frame's number, hide that frames came late. Poses stamped wrong lie before or
behind where the others put them along the platform's motion, by chance from one to the next: at all
frequencies alike. A swing holds less the faster, near a singularity up to what its frames show at
all. So jitter is measured where frames show least of a motion, mostly just below half their rate,
and by more frequencies where these show as much.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.fuse.found_share import widened_by_jitter
from freeswing.vision.fuse.fuse_cameras import Fit
from freeswing.vision.fuse.motion.motion_from_poses import Course
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.rig.stamp_jitter import LEAST_JITTER_S

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FASTEST = 0.4
"""Of the pose rate. Above it swings near a singularity at 30 Hz leave 0.03 to 0.08 ms (one 0.3),
from a third on twice that; what lies above 0.42 tells jitter to a third only, this to a fourth."""
FAST = 0.25
"""Of the pose rate, half of all that frames show: most swings are slower, and so much tells jitter
to a seventh."""
_HIGHEST = 0.5  # of the pose rate: frames show nothing faster
_LEAST_POSES = 20  # known and moving: a run of a second tells no frequencies
_SURE_SIGMAS = 3.0
"""Of a variance by so many free numbers: one run of a hundred."""
_ROUNDS = 30
"""Of the scale, which comes nearer by two thirds in each."""
_BEYOND = 1.5
"""Deviations beyond which a pose counts no more: a knock is not jitter of all stamps."""


class _Spread(NamedTuple):
    """Of poses along their motion: variance, what they claim, and how many numbers tell it."""

    variance_s2: float
    claimed_s2: float
    numbers: float


class _Along(NamedTuple):
    """How late poses are by what they miss.

    Attributes:
        moving: poses that are known and move, (n,).
        sought: coordinates that are, (6,).
        rows: of those poses, times their misses seconds, (m, k).
        claimed_s2: variance of these seconds, (m,).
    """

    moving: Mask
    sought: Mask
    rows: Array
    claimed_s2: Array


class SharedJitter(NamedTuple):
    """How late frames come by chance, all cameras' alike.

    Attributes:
        std_s: standard deviation; 0 where none shows.
        at_most: whether the motion may as well be that fast.
    """

    std_s: float
    at_most: bool = False


def along_the_motion(poses: Poses) -> SharedJitter:
    """Jitter that all stamps may have alike, by how poses lie along their motion.

    A bound where the platform's motion reaches up to half the frame rate: nothing tells them apart.
    """
    course = poses.course
    moving = poses.known & (np.abs(poses.motions[:, :6]).sum(axis=1) > 0.0)
    if course is None or not len(poses.covariances) or moving.sum() < _LEAST_POSES:
        return SharedJitter(0.0)
    ways = [_along(poses, course, moving, apart=apart) for apart in (False, True)]
    parts = [(FASTEST, _HIGHEST)]
    if course.spectrum.too_fast_hz is not None:  # perhaps an oscillation, perhaps jitter itself
        parts.append((FAST, FASTEST))
    told = [(_spread(course, way, *part), way) for part in parts for way in ways]
    least, way = min(told, key=lambda one: one[0].variance_s2)
    whole = _spread(course, way, FAST, _HIGHEST)
    by_chance = _SURE_SIGMAS * math.sqrt(2.0 / least.numbers + 2.0 / whole.numbers)
    at_most = whole.variance_s2 > least.variance_s2 * (1.0 + by_chance)
    found = least if at_most else whole
    if found.variance_s2 < found.claimed_s2 * (1.0 + _SURE_SIGMAS * math.sqrt(2.0 / found.numbers)):
        return SharedJitter(0.0)
    jitter = math.sqrt(found.variance_s2 - found.claimed_s2)
    if jitter < LEAST_JITTER_S:
        return SharedJitter(0.0)
    return SharedJitter(jitter * math.sqrt(_expected(found.numbers)), at_most)


def _expected(numbers: float) -> float:
    """What a normal number's square is expected to be, by the mean square of so many others.

    Source:
        Gelman et al. 2013, Bayesian Data Analysis, sec. 3.2: a variance that is not known makes a
        normal number one of Student's, here of no fewer than four degrees of freedom.
    """
    numbers = max(numbers, 4.0)
    return numbers / (numbers - 2.0)


def _along(poses: Poses, course: Course, moving: Mask, *, apart: bool) -> _Along:
    """How poses' misses are weighed along their motion: sharpest, or each coordinate `apart`.

    What is told sharply across a motion makes much of the little that a fast one leaves there.
    """
    sought = course.deviations > 0.0
    motion = poses.motions[moving, :6][:, sought]
    covariances = poses.covariances[moving][:, sought][:, :, sought]
    taken = covariances * np.eye(sought.sum()) if apart else covariances
    rows = np.linalg.solve(taken, motion[:, :, None])[:, :, 0]
    rows /= np.einsum("ni,ni->n", rows, motion)[:, None]
    claimed = np.einsum("ni,nij,nj->n", rows, covariances, rows)
    return _Along(moving, sought, rows, claimed)


def _spread(course: Course, way: _Along, low: float, high: float) -> _Spread:
    """How poses scatter along their motion between two shares of the pose rate."""
    missed = course.missed(low, high)
    shown = missed.variances[way.moving]
    late = np.einsum("ni,ni->n", way.rows, missed.misses[way.moving][:, way.sought])
    late /= np.sqrt(shown)
    sharp = way.claimed_s2 <= np.median(way.claimed_s2)
    return _Spread(
        robust_variance(late[sharp]),
        float(np.median(way.claimed_s2[sharp])),
        float(shown[sharp].sum()),
    )


def robust_variance(values: Array) -> float:
    """Of normal values about zero, (n,), of which a few are not.

    Source:
        Huber, Ronchetti 2009, Robust Statistics, sec. 5.2: proposal 2 for the scale.
    """
    tail = 0.5 * math.erfc(_BEYOND / math.sqrt(2.0))
    density = math.exp(-0.5 * _BEYOND**2) / math.sqrt(2.0 * math.pi)
    normal = 1.0 - 2.0 * tail - 2.0 * _BEYOND * density + 2.0 * _BEYOND**2 * tail
    squares = values**2
    variance = float(np.median(squares))
    for _ in range(_ROUNDS):
        capped = np.minimum(squares, _BEYOND**2 * variance)
        variance = float(capped.mean()) / normal
    return variance


def widened_along(poses: Poses, jitter_s: float) -> Poses:
    """Poses whose covariance holds the way in so much time."""
    if jitter_s == 0.0:
        return poses
    motion = poses.motions[:, :6] * jitter_s
    return replace(poses, covariances=poses.covariances + motion[:, :, None] * motion[:, None, :])


def widened_by_stamps(
    poses: Poses, fit: Fit, views: Sequence[CameraViews], watch: Watch, jitter_s: Array
) -> tuple[Poses, tuple[str, ...]]:
    """Poses whose covariances hold jitter of stamps, and what is said of what no camera tells."""
    poses = widened_by_jitter(poses, fit, views, watch, jitter_s)
    shared = along_the_motion(poses)
    if shared.std_s == 0.0 or poses.course is None:
        return poses, ()
    alike = " in all cameras alike" if len(views) > 1 else ""
    told = f"by {1e3 * shared.std_s:.2f} ms (standard deviation){alike}"
    rate = 1.0 / poses.course.spectrum.step_s
    said = (
        f"poses lie along their motion as stamps would put them that jitter {told}: their "
        "deviations count it"
    )
    if shared.at_most:
        said = (
            f"the platform moves as fast as {rate:.0f} frames a second just show: stamps that "
            f"jitter {told} could hide in it, which the poses' deviations count; record faster to "
            "tell"
        )
    return widened_along(poses, shared.std_s), (said,)
