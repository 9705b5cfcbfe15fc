"""The whole loop on the sample's robot: short tasks, seen by their numbers."""

import json
from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.files.problems import InputError
from freeswing.servo.design.offer import Order, offer
from freeswing.servo.design.schedule import Schedule
from freeswing.servo.driven_file import read_driven
from freeswing.servo.files.controller_file import Stored, read_controller, to_document
from freeswing.servo.files.task_file import Task, Watch
from freeswing.servo.files.weights_file import USUAL, Camera, Goals
from freeswing.servo.loop.anti_windup import LinearRegulator
from freeswing.servo.loop.closed_loop import Loop, run_loop
from freeswing.servo.loop.feasible_path import leaves_workspace
from freeswing.servo.loop.judge import judge
from freeswing.servo.loop.trials import Trial, carry_out, hardships, without_coulomb
from freeswing.servo.robot_now import Survey, motors_of, pose6, pose7
from freeswing.servo.synthesis.state_space import StateSpace
from tests.places import SAMPLES
from tests.servo.plants import DRUM_M, STIFFNESS, TORQUE_N_M_A, rotation

QUIET = Watch(Camera(0.005, 0.0107), 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def model():
    return read_driven(SAMPLES / "inca-6d")[1]


@pytest.fixture(scope="module")
def stored(model):
    found = offer(model, "hinf", Order(Goals(USUAL, Camera(0.005, 0.0107))))
    return Stored("hinf", found.sampled, found.wrench, False)


def step_to(x: float, watch: Watch = QUIET, end_s: float = 1.6) -> Task:
    poses = np.zeros((2, 6))
    poses[1, 0] = x
    return Task(np.array([0.0, 0.1]), poses, end_s, watch)


def test_poses_turn_into_quaternions_and_back():
    pose = np.array([0.1, -0.2, 0.3, 0.4, -0.5, 2.0])
    np.testing.assert_allclose(pose6(pose7(pose)), pose, atol=1e-14)
    w, x, y, z = pose7(pose)[3:]
    R = rotation(pose[3:])
    assert 1 - 2 * (y * y + z * z) == pytest.approx(R[0, 0])
    assert 2 * (x * y + w * z) == pytest.approx(R[1, 0])
    assert 2 * (y * z + w * x) == pytest.approx(R[2, 1])


def test_the_survey_is_the_papers_wrench_matrix(model):
    pose = np.array([0.1, -0.2, 0.15, 0.2, -0.1, 0.3])
    at = Survey(model).here(pose)
    robot = model.robot
    arms = np.array([c.attachment_m for c in robot.cables]) @ rotation(pose[3:]).T
    lines = pose[:3] + arms - robot.entries_m
    lengths = np.linalg.norm(lines, axis=1)
    along = lines / lengths[:, None]
    wanted = -np.hstack([along, np.cross(arms, along)]).T * TORQUE_N_M_A / DRUM_M
    np.testing.assert_allclose(at.wrench_matrix, wanted, atol=1e-12)
    np.testing.assert_allclose(at.springs_N, STIFFNESS / DRUM_M**2 * lengths, rtol=1e-12)
    assert motors_of(model).coulomb_N_m == pytest.approx(4.4e-3)


def test_a_step_without_friction_and_noise_comes_to_its_place(model, stored):
    outcome = carry_out(Trial("", step_to(0.1), without_coulomb(model), model), stored)
    last = outcome.judgement.steps[-1]
    assert outcome.judgement.held, outcome.judgement.why
    assert last.t90_s < 0.3, last.t90_s
    assert abs(outcome.run.poses[-1, 0] - 0.1) < 2e-3, outcome.run.poses[-1]
    assert outcome.judgement.outside == 0.0
    assert outcome.judgement.least_N > 1.48
    assert outcome.judgement.most_N < 18.5


def test_friction_leaves_a_step_short_and_feeding_it_forward_makes_up(model, stored):
    left = {}
    for feed in (False, True):
        trial = Trial("", step_to(0.1, end_s=3.1), model.declared, model, feed)
        left[feed] = abs(carry_out(trial, stored).run.poses[-1, 0] - 0.1)
    assert left[False] > 1e-3, left
    assert left[True] < left[False] / 3, left


def test_a_loop_with_more_delay_than_its_margin_is_lost(model, stored):
    late = replace(QUIET, camera=Camera(0.005, 0.08))
    outcome = carry_out(Trial("", step_to(0.1, late, 3.0), without_coulomb(model), model), stored)
    assert not outcome.judgement.held
    assert outcome.judgement.why


def test_the_camera_is_late_by_its_latency(model):
    class Recorder:
        def __init__(self):
            self.errors = []

        def wrench(self, error, asked, new):
            self.errors.append((error[0], new))
            return np.zeros(6)

        def applied(self, wrench):
            pass

    recorder = Recorder()
    rest = offer(model, "hinf", Order(Goals(USUAL, None))).wrench
    task = Task(np.zeros(1), np.zeros((1, 6)), 0.1, QUIET)
    truth = model.theta({"mass_kg": 1.3 * 0.289, "coulomb_N_m": 0.0})
    run = run_loop(Loop(model, truth, recorder, rest, task))
    news = [k for k, (_, new) in enumerate(recorder.errors) if new]
    assert news[:3] == [11, 16, 21], news[:3]
    seen = [-run.poses[k - 11, 0] for k in news]
    np.testing.assert_allclose([recorder.errors[k][0] for k in news], seen, atol=1e-12)


def test_the_same_seed_gives_the_same_run(model, stored):
    task = step_to(0.05, Watch(), 0.3)
    runs = [
        carry_out(Trial("", task, model.declared, model, seed=seed), stored).run
        for seed in (3, 3, 4)
    ]
    np.testing.assert_array_equal(runs[0].poses, runs[1].poses)
    assert np.abs(runs[0].poses - runs[2].poses).max() > 0


def test_a_regulator_that_asks_in_vain_does_not_wind_up():
    integrator = StateSpace(np.eye(6), 0.01 * np.eye(6), np.eye(6), np.zeros((6, 6)), 1e-3)
    regulator, asked = LinearRegulator(integrator), np.zeros(6)
    for _ in range(5000):
        asked = regulator.wrench(np.ones(6), np.zeros(6), True)
        regulator.applied(np.minimum(asked, 1.0))
    assert np.abs(asked).max() < 1.5, asked
    free = LinearRegulator(integrator)
    for _ in range(5000):
        asked = free.wrench(np.ones(6), np.zeros(6), True)
        free.applied(asked)
    assert asked[0] == pytest.approx(49.99)


def test_a_task_that_leaves_the_workspace_says_where_and_when(model):
    assert leaves_workspace(model, step_to(0.1)) is None
    said = leaves_workspace(model, step_to(1.2))
    assert said is not None
    assert "at 0.1 s it leaves the feasible workspace" in said
    said = leaves_workspace(model, step_to(1.4))
    assert said is not None
    assert "leaves the frame" in said


def test_hardships_are_other_robots_than_the_controllers(model):
    trials = hardships(model, step_to(0.1), feed=False, seed=0)
    assert [trial.name for trial in trials] == [
        "15 ms of latency",
        "mass x 1.3",
        "inertia x 3",
        "spring 1 x 0.8",
    ]
    assert trials[0].task.watch.camera.latency_s == 0.015
    assert trials[1].truth[model.index("mass_kg")] == pytest.approx(1.3 * 0.289)
    weak = trials[3]
    ratio = motors_of(weak.model, weak.truth).spring_N_m / motors_of(model).spring_N_m
    np.testing.assert_allclose(ratio, [0.8] + [1.0] * 7, rtol=1e-12)


def test_a_platform_that_is_pulled_away_is_lost(model):
    class Pull:
        def wrench(self, error, asked, new):
            return np.array([-30.0, 0, 0, 0, 0, 0])

        def applied(self, wrench):
            pass

    task = Task(np.zeros(1), np.zeros((1, 6)), 3.0, QUIET)
    run = run_loop(Loop(model, model.declared, Pull(), np.zeros(6), task))
    names = tuple(cable.name for cable in model.robot.cables)
    found = judge(run, task, names, motors_of(model).tension_limits_N)
    assert not found.held
    assert found.scaled > 0.5


def test_a_predictive_controller_reaches_its_place_through_a_file(model, tmp_path):
    found = offer(model, "mpc", Order(Goals(USUAL, Camera(0.005, 0.0107))))
    path = tmp_path / "controller.json"
    path.write_text(json.dumps(to_document(found)))
    stored = read_controller(path)
    assert stored.predictor is not None
    assert found.predictor is not None
    np.testing.assert_array_equal(stored.predictor.gain, found.predictor.gain)
    outcome = carry_out(Trial("", step_to(0.1), without_coulomb(model), model), stored)
    assert outcome.judgement.held, outcome.judgement.why
    assert abs(outcome.run.poses[-1, 0] - 0.1) < 2e-3, outcome.run.poses[-1]
    document = to_document(found)
    document["predictor"]["gain"] = [[1.0]]
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"predictor\.gain must be 6 by 12"):
        read_controller(path)


def test_a_scheduled_loop_turns_the_wrench_and_tells_the_regulator_what_came_of_it(model):
    class Recorder:
        def __init__(self):
            self.told = []

        def wrench(self, error, asked, new):
            return np.array([0.1, 0.0, 0.0, 0.0, 0.001, 0.0])

        def applied(self, wrench):
            self.told.append(wrench)

    recorder = Recorder()
    place = np.array([0.05, 0.3, -0.1, 0.0, 0.0, 0.05])
    rest = offer(model, "hinf", Order(Goals(USUAL, None))).wrench
    task = Task(np.zeros(1), place[None], 0.02, QUIET)
    run = run_loop(
        Loop(model, model.declared, recorder, rest, task, schedule=Schedule(model, np.zeros(6)))
    )
    factor = Schedule(model, np.zeros(6)).factor(place)
    np.testing.assert_allclose(run.wrenches[0] - rest, factor[:, 0] * 0.1 + factor[:, 4] * 0.001)
    np.testing.assert_allclose(recorder.told[0], [0.1, 0, 0, 0, 0.001, 0], atol=1e-12)


def test_a_controller_designed_for_the_encoders_brings_them_along(model):
    order = Order(Goals(USUAL, Camera(0.005, 0.0107)), by_encoders=True)
    found = offer(model, "hinf", order)
    assert found.delay_s == pytest.approx(0.0005)
    assert to_document(found)["carried_by_encoders"] is True
    late = replace(QUIET, camera=Camera(0.005, 0.05))
    stored = Stored("hinf", found.sampled, found.wrench, carried=True)
    trials = [
        carry_out(Trial("", step_to(0.1, late, 2.6), without_coulomb(model), model), one)
        for one in (stored, replace(stored, carried=False))
    ]
    # 52.5 ms are more than its delay margin; by the encoders they are no delay at all.
    jitter = [outcome.judgement.steps[-1].jitter_m for outcome in trials]
    assert jitter[0] < 1e-3, jitter
    assert jitter[1] > 5 * jitter[0], jitter
