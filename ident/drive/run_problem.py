"""One recorded run as residuals of a simulation, with exact slopes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.driven.motion import DrivenMotion, simulate_driven
from freeswing.cdpr.driven.record import DriveRecord, poses_at
from freeswing.cdpr.driven.sensitivity import N_POSE, state_slopes
from freeswing.cdpr.driven.slopes import length_slope, turn_map
from freeswing.cdpr.model.batch import evaluate
from freeswing.ident.drive.direct_kinematics import poses_from_turns
from freeswing.ident.drive.unknowns import Asked

Array = NDArray[np.float64]

# Newey and West's window: encoder counts and start errors stay alike for less than this.
SCORE_WINDOW_S = 0.1


@dataclass(frozen=True, slots=True)
class DriveRun:
    """One recording.

    Attributes:
        name: as in the session.
        role: "identify" or "validate".
        record: its samples.
        rate_hz: samples a second.
    """

    name: str
    role: str
    record: DriveRecord
    rate_hz: float


@dataclass(frozen=True, slots=True)
class Noise:
    """How the readings scatter.

    Attributes:
        angle_std_rad: of an encoder reading.
        pose_std: of small translations and turns, (6,).
        latency_s: the pose in a row was true this much earlier.
        current_std_A: of a measured current: of what flows at a run's start.
    """

    angle_std_rad: float
    pose_std: Array
    latency_s: float
    current_std_A: float


@dataclass(frozen=True, slots=True)
class Seen:
    """A run beside its simulation; a start is a pose's 6 and n currents: s = 6 + n.

    Attributes:
        motion: the simulation.
        angles: predicted less read, over their deviation, (n_t, n).
        poses: likewise of the rows with a pose, (n_p, 6).
        rows: those rows, (n_p,).
        angle_slopes: (n_t, n, s + k), or None.
        pose_slopes: (n_p, 6, s + k), or None.
    """

    motion: DrivenMotion
    angles: Array
    poses: Array
    rows: NDArray[np.intp]
    angle_slopes: Array | None
    pose_slopes: Array | None

    @property
    def slopes(self) -> tuple[Array, Array]:
        """Of angles and of poses.

        Raises:
            ValueError: where none were asked for.
        """
        if self.angle_slopes is None or self.pose_slopes is None:
            raise ValueError("the run was compared without slopes")
        return self.angle_slopes, self.pose_slopes


def simulated(
    model: DrivenModel,
    theta: Array,
    run: DriveRun,
    start_pose: Array,
    start_A: Array | None = None,
) -> DrivenMotion:
    """The run's references again, from rest at a pose and the currents that flowed there.

    Without `start_A` those are the measured ones.

    Raises:
        ValueError: when the platform is lost.
    """
    state = np.concatenate([start_pose, np.zeros(6)])
    record = run.record
    first = record.currents_A[0] if start_A is None else start_A
    return simulate_driven(model, state, record.references_A, run.rate_hz, theta, currents_A=first)


def compared(
    run: DriveRun, motion: DrivenMotion, zero: Array, noise: Noise, asked: Asked | None
) -> Seen:
    """Residuals over their deviations, and with unknowns their slopes by start and unknowns.

    Args:
        run: what was recorded.
        motion: what was simulated.
        zero: L / r where the angles are zero, (n,); its own slopes are added by the caller.
        noise: of the readings.
        asked: what to differentiate by; None: residuals alone.
    """
    record, rows = run.record, run.record.seen
    wanted = record.times_s[rows] - noise.latency_s
    true = poses_at(motion.times_s, motion.states, wanted)
    pose_gaps = _pose_gaps(true, record.poses[rows]) / noise.pose_std
    if asked is None:
        turns = evaluate(length_slope(motion.model), motion.poses, motion.theta)[0]
        gaps = (zero - turns - record.angles_rad) / noise.angle_std_rad
        return Seen(motion, gaps, pose_gaps, rows, None, None)
    spread = _spread(asked, motion.model.n_cables)
    states = state_slopes(motion, asked.members) @ spread
    turns, slopes = _turns(motion, asked, states)
    gaps = (zero - turns - record.angles_rad) / noise.angle_std_rad
    tangents = _tangents(motion, states)
    by_pose = _between(motion.times_s, tangents, wanted) / noise.pose_std[:, None]
    return Seen(motion, gaps, pose_gaps, rows, -slopes / noise.angle_std_rad, by_pose)


def _spread(asked: Asked, n: int) -> Array:
    """Which unknown moves which column of `state_slopes`: starts themselves, then the numbers."""
    whole = np.zeros((N_POSE + n + len(asked.members), N_POSE + n + len(asked.groups)))
    whole[: N_POSE + n, : N_POSE + n] = np.eye(N_POSE + n)
    whole[N_POSE + n :, N_POSE + n :] = asked.spread
    return whole


def _turns(motion: DrivenMotion, asked: Asked, states: Array) -> tuple[Array, Array]:
    """L / r at every sample (n_t, n) and its slopes by start and unknowns (n_t, n, s + k)."""
    found = evaluate(length_slope(motion.model, asked.members), motion.poses, motion.theta)
    slopes = found[1] @ states[:, :7]
    if asked.members:
        slopes[..., N_POSE + motion.model.n_cables :] += found[2] @ asked.spread
    return found[0], slopes


def _pose_gaps(true: Array, measured: Array) -> Array:
    """Predicted less measured: translation, and small turn in the platform frame, (n_p, 6)."""
    w, v = true[:, 3:4], true[:, 4:]
    a, b = measured[:, 3:4], measured[:, 4:]
    real = w * a + np.sum(v * b, axis=1, keepdims=True)
    turn = w * b - a * v - np.cross(v, b)
    return np.hstack([true[:, :3] - measured[:, :3], -2.0 * np.sign(real) * turn])


def _tangents(motion: DrivenMotion, states: Array) -> Array:
    """Slopes of poses as small translations and turns, (n_t, 6, s + k)."""
    turns = 4.0 * np.swapaxes(turn_map(motion.states[:, 3:7]), -1, -2) @ states[:, 3:7]
    return np.concatenate([states[:, :3], turns], axis=1)


def _between(times_s: Array, values: Array, wanted_s: Array) -> Array:
    inside = np.clip(wanted_s, times_s[0], times_s[-1])
    below = np.clip(np.searchsorted(times_s, inside, side="right") - 1, 0, len(times_s) - 2)
    part = ((inside - times_s[below]) / (times_s[below + 1] - times_s[below]))[:, None, None]
    return (1.0 - part) * values[below] + part * values[below + 1]


def score_matrix(seen: Seen) -> Array:
    """Covariance of the gradient that counts how residuals of neighbouring rows go together.

    Newey and West's estimate with a triangular window of `SCORE_WINDOW_S`.
    """
    by_angle, by_pose = seen.slopes
    scores = np.einsum("tnk,tn->tk", by_angle, seen.angles)
    np.add.at(scores, seen.rows, np.einsum("pik,pi->pk", by_pose, seen.poses))
    period = seen.motion.times_s[1] - seen.motion.times_s[0]
    window = max(1, round(SCORE_WINDOW_S / period))
    size = 2 * len(scores)
    kernel = np.zeros(size)
    lags = np.arange(window)
    kernel[lags] = 1.0 - lags / window
    kernel[-lags[1:]] = 1.0 - lags[1:] / window
    spectrum = np.fft.rfft(scores, size, axis=0) * np.fft.rfft(kernel)[:, None]
    smooth = np.fft.irfft(spectrum, size, axis=0)[: len(scores)]
    return scores.T @ smooth


def start_pose(model: DrivenModel, theta: Array, run: DriveRun, zero: Array) -> Array:
    """Where a run begins, by its first angles, (7,)."""
    first = run.record.poses[run.record.seen[0]] if len(run.record.seen) else None
    guess = np.array([0, 0, 0, 1.0, 0, 0, 0]) if first is None else first
    turns = (zero - run.record.angles_rad[0])[None]
    return poses_from_turns(model, theta, turns, guess)[0][0]
