"""One recorded run as residuals of a simulation, with exact slopes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.behaviour import readings_of, simulate, stretch_of
from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.driven.motion import DrivenMotion
from freeswing.cdpr.driven.record import DriveRecord, poses_at
from freeswing.cdpr.driven.sensitivity import N_POSE, state_slopes
from freeswing.cdpr.driven.slopes import length_slope, moved, turn_map
from freeswing.cdpr.effects import Effect, effect_named
from freeswing.cdpr.model.batch import evaluate
from freeswing.ident.drive.direct_kinematics import poses_from_turns
from freeswing.ident.drive.unknowns import Asked

Array = NDArray[np.float64]

# Newey and West's window: encoder counts and start errors stay alike for less than this.
SCORE_WINDOW_S = 0.1
# Of an effect's typical size: what elastic cables and instruments answer is a difference over it.
DIFFERENCE = 0.02
NUMBER_STEP = 1e-4  # of a number itself
POSE_STEP = 1e-5  # metres and radians
CURRENT_STEP_A = 1e-3


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


def head_of(run: DriveRun, seconds: float) -> DriveRun:
    """The run's first part, of two samples at least."""
    rows = max(2, round(seconds * run.rate_hz))
    record = run.record
    cut = DriveRecord(*(getattr(record, name)[:rows] for name in DriveRecord.__slots__))
    return replace(run, record=cut)


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
    return simulate(model, state, given_A(model, run), run.rate_hz, theta, currents_A=first)


def given_A(model: DrivenModel, run: DriveRun) -> Array:
    """References as the drives can follow them: within each motor's limits, (n_t, n)."""
    limits = model.drive.current_limits_A
    return np.clip(run.record.references_A, limits[:, 0], limits[:, 1])


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
    told = _told(run, motion, noise)
    pose_gaps = _pose_gaps(told.poses, record.poses[rows]) / noise.pose_std
    gaps = (zero - told.turns - record.angles_rad) / noise.angle_std_rad
    if asked is None:
        return Seen(motion, gaps, pose_gaps, rows, None, None)
    if motion.lengths_out_m is not None:
        turns, poses = _elastic_slopes(run, motion, noise, asked, told)
        by_pose = poses / noise.pose_std[:, None]
        return Seen(motion, gaps, pose_gaps, rows, -turns / noise.angle_std_rad, by_pose)
    spread = _spread(asked, motion.model.n_cables)
    states = state_slopes(motion, asked.members) @ spread
    turns = _turn_slopes(motion, asked, states)
    poses = _between(motion.times_s, _tangents(motion, states), told.times_s)
    n_start = N_POSE + motion.model.n_cables
    for k, name in enumerate(asked.members):
        if _is_beside(motion.model, name):
            more = _differences(run, motion, noise, name, told)
            turns[..., n_start:] += more[0][..., None] * asked.spread[k]
            poses[..., n_start:] += more[1][..., None] * asked.spread[k]
    by_pose = poses / noise.pose_std[:, None]
    return Seen(motion, gaps, pose_gaps, rows, -turns / noise.angle_std_rad, by_pose)


@dataclass(frozen=True, slots=True)
class _Told:
    """What the instruments would tell of a motion.

    Attributes:
        turns: L / r less what the encoders read too much, (n_t, n).
        poses: of the rows with one, (n_p, 7).
        times_s: when those were true, (n_p,).
    """

    turns: Array
    poses: Array
    times_s: Array


def _told(run: DriveRun, motion: DrivenMotion, noise: Noise, theta: Array | None = None) -> _Told:
    """With `theta`, the instruments' errors are those of other numbers than the motion's."""
    theta = motion.theta if theta is None else theta
    errors = readings_of(motion.model, theta, motion.times_s)
    wanted = run.record.times_s[run.record.seen] - noise.latency_s - errors.latency_s
    poses = poses_at(motion.times_s, motion.states, wanted)
    return _Told(motion.turns - errors.offsets_rad, poses, wanted)


def _elastic_slopes(
    run: DriveRun, motion: DrivenMotion, noise: Noise, asked: Asked, told: _Told
) -> tuple[Array, Array]:
    """Slopes of turns (n_t, n, s + k) and poses (n_p, 6, s + k) by differences of simulations.

    The steps of elastic cables are the same on both sides: differences see no switch.
    """
    model, start, first = motion.model, motion.states[0], motion.currents_A[0]
    n = model.n_cables

    def ahead(shift: Array, current: Array, theta: Array) -> _Told:
        state = np.concatenate([moved(start[:7], shift), start[7:]])
        other = simulate(
            model, state, motion.references_A, run.rate_hz, theta, currents_A=first + current
        )
        return _told(run, other, noise, theta)

    columns = []
    for k in range(N_POSE):
        there = ahead(POSE_STEP * np.eye(N_POSE)[k], np.zeros(n), motion.theta)
        columns.append((there, POSE_STEP))
    for k in range(n):
        there = ahead(np.zeros(N_POSE), CURRENT_STEP_A * np.eye(n)[k], motion.theta)
        columns.append((there, CURRENT_STEP_A))
    for group in asked.groups:
        theta, step = motion.theta.copy(), step_of(model, motion.theta, group.name)
        for member in group.members:
            theta[model.index(member)] += step
        columns.append((ahead(np.zeros(N_POSE), np.zeros(n), theta), step))
    turns = [(there.turns - told.turns) / step for there, step in columns]
    poses = [_pose_gaps(there.poses, told.poses) / step for there, step in columns]
    return np.stack(turns, axis=-1), np.stack(poses, axis=-1)


def step_of(model: DrivenModel, theta: Array, name: str) -> float:
    """By how much a number changes for a difference."""
    place = model.index(name)
    first = len(model.numbers.names)
    if place >= first:
        step = DIFFERENCE * model.parameters[place - first].scale
        own = NUMBER_STEP * abs(float(theta[place]))
        return min(step, own or step) if gives_way(model, name) else step
    return NUMBER_STEP * abs(float(theta[place])) or NUMBER_STEP


def gives_way(model: DrivenModel, name: str) -> bool:
    """Whether a number is of an effect that makes cables elastic.

    Those swing a hundred radians a second: a hundredth more stiffness turns a second's end by one,
    and is no derivative any more.
    """
    effect = name.partition(".")[0]
    return effect in model.effects and type(effect_named(effect)).stretch is not Effect.stretch


def _is_beside(model: DrivenModel, name: str) -> bool:
    """Whether a number is of an effect that the rigid equations know nothing of."""
    effect = name.partition(".")[0]
    return effect in model.effects and effect_named(effect).beside_motion


def _differences(
    run: DriveRun, motion: DrivenMotion, noise: Noise, name: str, told: _Told
) -> tuple[Array, Array]:
    """How turns (n_t, n) and poses (n_p, 6) answer to a number beside the rigid equations."""
    model, place = motion.model, motion.model.index(name)
    theta, step = motion.theta.copy(), step_of(model, motion.theta, name)
    theta[place] += step
    other = motion
    if stretch_of(model, theta) != stretch_of(model, motion.theta):
        now, start = motion, motion.states[0]
        other = simulate(
            model, start, now.references_A, run.rate_hz, theta, currents_A=now.currents_A[0]
        )
    ahead = _told(run, other, noise, theta)
    return (ahead.turns - told.turns) / step, _pose_gaps(ahead.poses, told.poses) / step


def _spread(asked: Asked, n: int) -> Array:
    """Which unknown moves which column of `state_slopes`: starts themselves, then the numbers."""
    whole = np.zeros((N_POSE + n + len(asked.members), N_POSE + n + len(asked.groups)))
    whole[: N_POSE + n, : N_POSE + n] = np.eye(N_POSE + n)
    whole[N_POSE + n :, N_POSE + n :] = asked.spread
    return whole


def _turn_slopes(motion: DrivenMotion, asked: Asked, states: Array) -> Array:
    """Slopes of L / r at every sample by start and unknowns, (n_t, n, s + k)."""
    found = evaluate(length_slope(motion.model, asked.members), motion.poses, motion.theta)
    slopes = found[1] @ states[:, :7]
    if asked.members:
        slopes[..., N_POSE + motion.model.n_cables :] += found[2] @ asked.spread
    return slopes


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

    Source:
        Newey, West 1987, A simple, positive semi-definite covariance matrix.
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
