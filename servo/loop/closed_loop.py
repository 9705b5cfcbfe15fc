"""The whole loop at the control rate: watch, control, distribute, move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.driven.motion import Stepper
from freeswing.cdpr.model.batch import evaluate
from freeswing.servo.design.plant import CONTROL_RATE_HZ
from freeswing.servo.design.schedule import Schedule
from freeswing.servo.files.task_file import Task
from freeswing.servo.loop.camera import CameraFeed, Sighting
from freeswing.servo.loop.friction import FrictionFeed
from freeswing.servo.loop.held_or_lost import is_lost
from freeswing.servo.loop.regulator import Regulator
from freeswing.servo.robot_now import Here, Motors, Survey, pose6, pose7
from freeswing.servo.synthesis.state_space import Array
from freeswing.servo.tensions.loop_kernels import NEAREST, Currents, distribute
from freeswing.servo.tensions.robot_wrenches import OBJECTIVE_N

# The encoders' differences are smoothed over about this long before they count as rates.
RATE_FILTER_S = 0.005


@dataclass(frozen=True, slots=True)
class Loop:
    """All that one run of the loop needs.

    Attributes:
        model: the controller's own, as declared.
        truth: numbers of the robot that moves, (len(model.names),).
        regulator: the controller.
        rest_wrench: F_ev at the pose it was designed about, (6,).
        task: poses asked for, and what the loop sees.
        friction: fed forward, or None.
        by_encoders: carry each pose on to now by what the encoders have turned since.
        joint: the regulator works on motor angles turned into a pose error by the encoders alone.
        schedule: turns the regulator's wrench into that of each place, or None.
        seed: of the camera's noise.
    """

    model: DrivenModel
    truth: Array
    regulator: Regulator
    rest_wrench: Array
    task: Task
    friction: FrictionFeed | None = None
    by_encoders: bool = False
    joint: bool = False
    schedule: Schedule | None = None
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Run:
    """What happened, one row a control sample.

    Attributes:
        times_s: (n_t,).
        asked: poses asked for, (n_t, 6).
        poses: true poses, (n_t, 6).
        wrenches: F_ev commanded, (n_t, 6).
        references_A: (n_t, n).
        currents_A: (n_t, n).
        tensions_N: of the moving robot, negative where a cable would have to push, (n_t, n).
        scales: share of each wrench that was feasible, (n_t,).
        lost_s: when the platform was lost, None if it never was.
    """

    times_s: Array
    asked: Array
    poses: Array
    wrenches: Array
    references_A: Array
    currents_A: Array
    tensions_N: Array
    scales: Array
    lost_s: float | None


def run_loop(loop: Loop) -> Run:
    """Step the loop through its task; it ends early where the platform is lost."""
    count = round(loop.task.end_s * CONTROL_RATE_HZ)
    times = np.arange(count) / CONTROL_RATE_HZ
    asked = loop.task.at(times)
    body, brain = _Body(loop, asked[0]), _Brain(loop, asked[0])
    record = _Record(count, loop.model.n_cables)
    lost = None
    for k in range(count):
        pose, angles = pose6(body.state), body.angles()
        if is_lost(pose[:3] - asked[k, :3]):
            lost, count = float(times[k]), k
            break
        wrench, answer = brain.decide(float(times[k]), asked[k], pose, angles)
        record.put(k, pose, body, answer, wrench)
        body.move(answer.x)
    tensions = np.zeros((0, loop.model.n_cables))
    if count:
        tensions = evaluate(
            loop.model.motion, record.states[:count], record.currents[:count], loop.truth
        )[1]
    return Run(
        times[:count],
        asked[:count],
        record.poses[:count],
        record.wrenches[:count],
        record.references[:count],
        record.currents[:count],
        tensions,
        record.scales[:count],
        lost,
    )


class _Record:
    def __init__(self, count: int, n: int) -> None:
        self.states, self.currents = np.empty((count, 13)), np.empty((count, n))
        self.poses = np.empty((count, 6))
        self.references, self.wrenches = np.empty((count, n)), np.empty((count, 6))
        self.scales = np.empty(count)

    def put(self, k: int, pose: Array, body: _Body, answer: Currents, wrench: Array) -> None:
        self.poses[k], self.states[k], self.currents[k] = pose, body.state, body.currents
        self.references[k], self.wrenches[k], self.scales[k] = answer.x, wrench, answer.scale


class _Body:
    """The robot that really moves."""

    def __init__(self, loop: Loop, start: Array) -> None:
        self._survey = Survey(loop.model, loop.truth)
        self._step = Stepper(loop.model, loop.truth, 1.0 / CONTROL_RATE_HZ)
        self.state = np.concatenate([pose7(start), np.zeros(6)])
        self._zero = self._survey.lengths_m(self.state[:7])
        self._encoder = loop.task.watch.encoder_step_rad
        declared = Survey(loop.model)
        self.currents = _distributed(declared.here(start), declared.motors, loop.rest_wrench).x

    def angles(self) -> Array:
        """Motor angles, zero at the start, as the encoders give them."""
        lengths = self._survey.lengths_m(self.state[:7])
        angles = (self._zero - lengths) / self._survey.motors.drum_m
        return angles if self._encoder == 0.0 else np.round(angles / self._encoder) * self._encoder

    def move(self, references: Array) -> None:
        """One control period."""
        state, currents, _ = self._step.advance(self.state, self.currents, references)
        self.state, self.currents = state.copy(), currents.copy()


class _Brain:
    """What runs on the control computer; it knows the declared robot alone."""

    def __init__(self, loop: Loop, start: Array) -> None:
        self._loop, self._start = loop, start
        self._survey = Survey(loop.model)
        self._motors = self._survey.motors
        n = loop.model.n_cables
        first = Sighting(0.0, 0.0, start, np.zeros(n))
        self._feed = CameraFeed(loop.task.watch, first, np.random.default_rng(loop.seed))
        self._here = self._survey.here(start)
        self._zero_lengths = self._here.lengths_m
        self._inverse = self._pose_from_angles()
        self._turn = self._scheduled(start)
        self._angles, self._rates = np.zeros(n), np.zeros(n)
        self._asked, self._asked_angles = start, np.zeros(n)

    def decide(
        self, time_s: float, asked: Array, pose: Array, angles: Array
    ) -> tuple[Array, Currents]:
        """The wrench commanded and the currents for it."""
        new = self._feed.look(time_s, pose, angles)
        if new:
            # Tensions that balance each other at an old pose push at the new one: where the
            # encoders know the new one, it is taken.
            known = self._known_pose(angles)
            self._here = self._survey.here(known)
            self._turn = self._scheduled(known)
            if self._loop.by_encoders:
                self._inverse = self._pose_from_angles()
        if not np.array_equal(asked, self._asked):
            self._asked = asked
            lengths = self._survey.lengths_m(pose7(asked))
            self._asked_angles = (self._zero_lengths - lengths) / self._motors.drum_m
        self._follow(angles)
        rest, turn = self._loop.rest_wrench, self._turn
        change = self._loop.regulator.wrench(self._error(asked, angles), asked, new)
        wrench = rest + (change if turn is None else turn @ change)
        answer = _distributed(self._here, self._motors, wrench)
        given = answer.scale * wrench - rest
        if turn is not None:
            given = np.asarray(np.linalg.solve(turn, given), dtype=np.float64)
        self._loop.regulator.applied(given)
        return wrench, self._with_friction(answer, angles)

    def _error(self, asked: Array, angles: Array) -> Array:
        if self._loop.joint:
            return self._inverse @ (self._asked_angles - angles)
        return asked - self._known_pose(angles)

    def _known_pose(self, angles: Array) -> Array:
        """The latest pose, carried on to now by the encoders where they serve."""
        seen = self._feed.latest
        if self._loop.by_encoders:
            return seen.pose + self._inverse @ (angles - seen.angles_rad)
        return seen.pose

    def _scheduled(self, pose: Array) -> Array | None:
        schedule = self._loop.schedule
        return None if schedule is None else schedule.factor(pose)

    def _follow(self, angles: Array) -> None:
        share = 1.0 - np.exp(-1.0 / (CONTROL_RATE_HZ * RATE_FILTER_S))
        self._rates += share * ((angles - self._angles) * CONTROL_RATE_HZ - self._rates)
        self._angles = angles

    def _pose_from_angles(self) -> Array:
        """Least squares of d theta = -J~ dX by the wrench matrix: W_I = -J~' k_em in base axes."""
        gear = self._here.wrench_matrix.T / self._motors.torque_N_m_A[:, None]
        return np.asarray(np.linalg.pinv(gear), dtype=np.float64)

    def _with_friction(self, answer: Currents, angles: Array) -> Currents:
        feed = self._loop.friction
        if feed is None:
            return answer
        more = feed.currents(self._rates, self._asked_angles - angles)
        low, high = self._motors.current_limits_A.T
        return answer._replace(x=np.clip(answer.x + more, low, high))


def current_bounds(at: Here, motors: Motors) -> tuple[Array, Array, Array]:
    """Least, greatest and wished currents at a pose, by currents' and tensions' limits, (n,).

    Source:
        INCA 2016, eqs. (9), (11) at rest.
    """
    per_A = motors.tension_per_A
    low = np.maximum(
        motors.current_limits_A[:, 0], (motors.tension_limits_N[:, 0] - at.springs_N) / per_A
    )
    high = np.minimum(
        motors.current_limits_A[:, 1], (motors.tension_limits_N[:, 1] - at.springs_N) / per_A
    )
    return low, high, (OBJECTIVE_N - at.springs_N) / per_A


def _distributed(at: Here, motors: Motors, wrench: Array) -> Currents:
    low, high, wish = current_bounds(at, motors)
    answer = distribute(at.wrench_matrix, wrench, np.zeros(6), low, high, wish, NEAREST)
    if np.isnan(answer.scale):
        # Nothing is feasible here: pull as hard as the objective does, and say so by scale 0.
        held = np.clip(wish, motors.current_limits_A[:, 0], motors.current_limits_A[:, 1])
        return answer._replace(x=held, scale=0.0)
    return answer
