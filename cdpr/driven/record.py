"""What the instruments of a driven robot tell of a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.behaviour import readings_of
from freeswing.cdpr.driven.motion import DrivenMotion
from freeswing.cdpr.driven.slopes import moved

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class DriveRecord:
    """Samples of one run, read-only.

    Attributes:
        times_s: (n_t,).
        currents_A: measured, (n_t, n).
        references_A: held from each row to the next, (n_t, n).
        angles_rad: encoder readings, growing with winding, (n_t, n).
        poses: position and quaternion, NaN in rows without one, (n_t, 7).
    """

    times_s: Array
    currents_A: Array
    references_A: Array
    angles_rad: Array
    poses: Array

    def __post_init__(self) -> None:
        for name in self.__slots__:
            array = np.array(getattr(self, name), dtype=np.float64)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def seen(self) -> NDArray[np.intp]:
        """Rows that have a pose."""
        return np.flatnonzero(np.isfinite(self.poses).all(axis=1))


@dataclass(frozen=True, slots=True)
class Instruments:
    """How a motion is measured.

    Attributes:
        pose_rate_hz: poses a second, at most the sample rate.
        latency_s: the pose in a row was true this much earlier.
        position_std_m: noise of each coordinate.
        angle_std_rad: noise of each component of the small turn.
        encoder_step_rad: 0: exact angles.
        current_std_A: noise of each measured current.
    """

    pose_rate_hz: float = 200.0
    latency_s: float = 0.0
    position_std_m: float = 0.0
    angle_std_rad: float = 0.0
    encoder_step_rad: float = 0.0
    current_std_A: float = 0.0


def observed(
    motion: DrivenMotion,
    zero_pose: Array,
    instruments: Instruments,
    generator: np.random.Generator,
) -> DriveRecord:
    """The readings of a motion: quantised angles, late and noisy poses, noisy currents.

    Args:
        motion: what happened.
        zero_pose: where all angles are zero, (7,).
        instruments: how it is measured.
        generator: of the noise.

    What the model's effects do to readings is in them.
    """
    errors = readings_of(motion.model, motion.theta, motion.times_s)
    angles = motion.angles_rad(zero_pose) + errors.offsets_rad
    if instruments.encoder_step_rad > 0.0:
        angles = np.round(angles / instruments.encoder_step_rad) * instruments.encoder_step_rad
    noise = generator.normal(size=motion.currents_A.shape) * instruments.current_std_A
    poses = np.full((len(motion.times_s), 7), np.nan)
    rate = 1.0 / (motion.times_s[1] - motion.times_s[0])
    every = max(1, round(rate / instruments.pose_rate_hz))
    rows = np.arange(0, len(poses), every)
    late = instruments.latency_s + errors.latency_s
    true = poses_at(motion.times_s, motion.states, motion.times_s[rows] - late)
    stds = np.repeat([instruments.position_std_m, instruments.angle_std_rad], 3)
    poses[rows] = moved(true, generator.normal(size=(len(rows), 6)) * stds)
    return DriveRecord(
        motion.times_s, motion.currents_A + noise, motion.references_A, angles, poses
    )


def poses_at(times_s: Array, states: Array, wanted_s: Array) -> Array:
    """Poses between samples, from the nearest sample's pose and twist, (len(wanted), 7).

    Before the first sample and after the last the robot is where it was there: runs start at
    rest. Second order in half a sample: 0.5 ms at 40 m/s^2 is 5 micrometres.

    Source:
        Hairer, Norsett, Wanner 1993, Solving Ordinary Differential Equations I, sec. II.6:
        dense output, here of second order.
    """
    inside = np.clip(wanted_s, times_s[0], times_s[-1])
    grain = 1e-6 * (times_s[1] - times_s[0])  # so that a time on the grid is taken as it is
    below = np.searchsorted(times_s, inside + grain, side="right") - 1
    below = np.clip(below, 0, len(times_s) - 2)
    step = (times_s[below + 1] - times_s[below])[:, None]
    part = (inside - times_s[below])[:, None] / step
    first, last = states[below], states[below + 1]
    # Velocity between samples is linear: the shift from the earlier sample is its integral.
    shift = step * part * (first[:, 7:] + 0.5 * part * (last[:, 7:] - first[:, 7:]))
    return moved(first[:, :7], shift)
