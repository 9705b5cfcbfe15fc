"""Where the platform is between its poses, and how well that is known.

Cameras take their frames at different times, and what one of them saw has to be carried to the
instant of a pose. A polynomial through a few poses misses an oscillation that has four of them to
a period. Poses over a long stretch know the frequencies of which the motion is made; the most
likely motion between them then follows with its variance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.rotation import exp_rotation, log_rotation
from freeswing.vision.fuse.motion.motion_spectrum import Spectrum
from freeswing.vision.fuse.motion.spectrum_kernels import Patterns, inverse_covariances, motion_rows

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

STRETCH = 48  # poses of which a motion between two is made
_TOGETHER = 12  # instants in the middle of one stretch
_STRETCHES_READ = 6  # for the spectrum, spread over a run
_ROUNDS = 8
_SAME_TIME_S = 1e-11  # a platform's way in it is a millionth of what its poses err by


class Carried(NamedTuple):
    """The platform at some times near instants.

    Attributes:
        shifts: from the instant's position and rotation, (n, 6).
        motions: velocity, angular velocity, and their rates in the base frame, (n, 12).
        variances: of the shifts, (n, 6).
    """

    shifts: Array
    motions: Array
    variances: Array


class Missed(NamedTuple):
    """What poses miss a motion by that holds some frequencies only.

    Attributes:
        misses: of position and small rotation, by the inverse of all poses' covariance, (n, 6).
        variances: of these in poses that scatter about such a motion as they claim, in that of a
            pose's own noise, (n,); zero where no pose is known.
    """

    misses: Array
    variances: Array


@dataclass(frozen=True, slots=True)
class Course:
    """A run's motion.

    Attributes:
        times_s: of the poses, (n,).
        positions_m: (n, 3).
        rotations: (n, 3, 3).
        known: (n,).
        deviations: of position and small rotation, zero where these are not sought, (6,).
        spectrum: of what the motion is made.
    """

    times_s: Array
    positions_m: Array
    rotations: Array
    known: Mask
    deviations: Array
    spectrum: Spectrum

    def carried(self, instants: Ints, lags_s: Array) -> Carried:
        """The platform so long after instants, (n,) each.

        Source:
            Rasmussen, Williams 2006, Gaussian Processes for Machine Learning, sec. 2.2 and 9.4:
            prediction of values and slopes.
        """
        pairs, where = np.unique(
            np.stack([instants.astype(float), lags_s]), axis=1, return_inverse=True
        )
        which, lags_s = pairs[0].astype(np.int64), pairs[1]  # in order of instants
        groups, group_of = np.unique(which // _TOGETHER, return_inverse=True)
        stretch = self._stretches(groups)
        patterns, waves = stretch.patterns(), self.spectrum.waves()
        rows = motion_rows(
            patterns,
            inverse_covariances(patterns, waves),
            np.ascontiguousarray(stretch.steps),
            waves,
            group_of,
            self.times_s[which] - stretch.about_s[group_of],
            lags_s,
        )
        before, after, rates, bends = (one * self.deviations for one in rows[:4])
        shifts = after - before
        back = np.swapaxes(exp_rotation(before[:, 3:]), -1, -2)
        shifts[:, 3:] = log_rotation(exp_rotation(after[:, 3:]) @ back)
        turned = [spin(after[:, 3:], one[:, 3:]) for one in (rates, bends)]
        motions = np.concatenate([rates[:, :3], turned[0], bends[:, :3], turned[1]], axis=1)
        share = np.minimum(np.abs(lags_s) / self.spectrum.step_s, 1.0)
        more = self.spectrum.excess * 4.0 * np.sin(0.5 * np.pi * share) ** 2
        variances = np.maximum(rows.open + more, 0.0)[:, None] * self.deviations**2
        where = where.ravel()
        return Carried(shifts[where], motions[where], variances[where])

    def missed(self, low: float, high: float) -> Missed:
        """What poses show between two shares of the pose rate.

        Source:
            Rasmussen, Williams 2006, Gaussian Processes for Machine Learning, sec. 2.2: the inverse
            covariance leaves what no motion of these frequencies explains.
        """
        n = len(self.times_s)
        stretch = self._stretches(np.arange(-(-n // _TOGETHER)))
        patterns = stretch.patterns()
        inverses = inverse_covariances(patterns, self.spectrum.without(low, high).waves())
        at = np.arange(n)
        group = at // _TOGETHER
        own = at - stretch.first[group]
        pulled = inverses[patterns.of] @ stretch.steps
        squares = np.einsum("pij,pji->pi", inverses, inverses)[patterns.of]
        variances = np.where(self.known, squares[group, own], 0.0)
        return Missed(pulled[group, own] * self.deviations, variances)

    def _stretches(self, groups: Ints) -> _Stretches:
        return _stretches(
            self.times_s, self.positions_m, self.rotations, self.known, self.deviations, groups
        )


class _Stretches(NamedTuple):
    """Poses about groups: the first (g,), times (g, w), middle, steps from there in deviations."""

    first: Ints
    times_s: Array
    about_s: Array
    steps: Array
    known: Mask

    def patterns(self) -> Patterns:
        """Those of even stamps without gaps have one in common."""
        rows = np.concatenate([np.round(self.times_s / _SAME_TIME_S), 1.0 * self.known], axis=1)
        _, first, of = np.unique(rows, axis=0, return_index=True, return_inverse=True)
        return Patterns(self.times_s[first], self.known[first], of.ravel())


def _stretches(
    times_s: Array, positions: Array, rotations: Array, known: Mask, deviations: Array, groups: Ints
) -> _Stretches:
    n = len(times_s)
    width = min(STRETCH, n)
    middle = np.minimum(groups * _TOGETHER + _TOGETHER // 2, n - 1)
    first = np.clip(middle - width // 2, 0, n - width)
    index = first[:, None] + np.arange(width)
    usable = known[index]
    near = np.argmin(np.where(usable, np.abs(index - middle[:, None]), n), axis=1)
    about = index[np.arange(len(groups)), near]
    relative = np.matmul(rotations[index], np.swapaxes(rotations[about], 1, 2)[:, None])
    relative = np.where(usable[..., None, None], relative, np.eye(3))
    shifts = positions[index] - positions[about][:, None]
    steps = np.concatenate([shifts, log_rotation(relative)], axis=-1)
    steps = np.where(usable[..., None], steps, 0.0)
    scaled = np.where(deviations > 0.0, steps / np.where(deviations > 0.0, deviations, 1.0), 0.0)
    at = times_s[middle]
    return _Stretches(first, times_s[index] - at[:, None], at, scaled, usable)


def course_of(
    times_s: Array,
    positions_m: Array,
    rotations: Array,
    known: Mask,
    deviations: Array,
    before: Spectrum | None = None,
) -> Course | None:
    """The motion through poses; None where fewer than two are known.

    Args:
        times_s: (n,).
        positions_m: (n, 3).
        rotations: (n, 3, 3).
        known: (n,).
        deviations: of positions and small rotations, zero where these are not sought, (6,).
        before: a spectrum to start from.
    """
    if known.sum() < 2:
        return None
    groups = np.unique(np.linspace(0, (len(times_s) - 1) // _TOGETHER, _STRETCHES_READ).round())
    stretch = _stretches(
        times_s, positions_m, rotations, known, deviations, groups.astype(np.int64)
    )
    sought = deviations > 0.0
    steps = stretch.steps[:, :, sought]
    if before is None:
        size = float((steps**2).sum() / (stretch.known.sum() * max(sought.sum(), 1)))
        before = Spectrum.unknown(float(np.median(np.diff(times_s))), size)
    plain = Spectrum(before.step_s, before.power, 1.0)
    steps = np.ascontiguousarray(steps)
    spectrum = plain.improved(stretch.patterns(), steps, _ROUNDS).with_noise()
    return Course(times_s, positions_m, rotations, known, deviations, spectrum)


def spin(turn: Array, rate: Array) -> Array:
    """Angular velocity of exp(turn) where turn changes at a rate, (n, 3) each.

    Source:
        Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, ch. 2: the
        spatial velocity in exponential coordinates.
    """
    angle2 = (turn**2).sum(axis=1, keepdims=True)
    angle = np.sqrt(np.maximum(angle2, 1e-12))
    first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    across = np.cross(turn, rate)
    return rate + first * across + second * np.cross(turn, across)
