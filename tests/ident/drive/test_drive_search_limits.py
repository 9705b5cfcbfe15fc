"""Limits of slack, ramps and searches of driven robots, on both sides, without any robot."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.commands.session import drive as drive_command
from freeswing.ident.drive import added_effects, elastic_search, identify, predicted_run
from freeswing.ident.drive.diagnose import refit
from freeswing.ident.drive.plan import plan_poses
from freeswing.ident.drive.records import mistaken_records, ramps, slack
from freeswing.ident.drive.run_problem import DriveRun
from freeswing.ident.drive.solver import Normal, minimise
from tests.ident.drive.test_drive_limits import Seen, run_of, session_of


def stub(**more: object) -> Any:
    """What a test needs of a session, a run or a model, and no more."""
    return SimpleNamespace(**more)


STEP = 1e-3


def motion_of(pushing, rate_hz=1000.0):
    times = np.arange(len(pushing)) / rate_hz
    return stub(times_s=times, slack=np.array(pushing)[:, None], lengths_out_m=None)


@pytest.mark.parametrize(("seconds", "until"), [(0.0049, 10000), (0.0051, 2000)])
def test_slack_lasts_five_milliseconds(seconds, until):
    pushing = np.zeros(10000, dtype=bool)
    pushing[2000 : 2000 + round(1e4 * seconds)] = True
    assert slack.first_slack(motion_of(pushing, 1e4)) == until


@pytest.mark.parametrize(("first", "kept"), [(515, None), (525, 505)])
def test_half_a_second_must_be_left_and_twenty_milliseconds_are_not(monkeypatch, first, kept):
    pushing = np.zeros(1000, dtype=bool)
    pushing[first:] = True
    monkeypatch.setattr(slack, "simulated", lambda *_: motion_of(pushing))
    monkeypatch.setattr(slack, "start_pose", lambda *_: None)
    monkeypatch.setattr(slack, "head_of", lambda _, seconds: round(1000 * seconds))
    robot = stub(cables=[stub(name="1")])
    run = stub(name="a", rate_hz=1000.0)
    if kept is None:
        with pytest.raises(ValueError, match=r"cable 1 is slack from 0\.5"):
            slack.before_slack(stub(robot=robot), None, (run,), None)
    else:
        assert slack.before_slack(stub(robot=robot), None, (run,), None) == (kept,)


def ramp_run(rows=100, rising=None, angles=None):
    references = np.zeros((rows, 2))
    rising = rows - 1 if rising is None else rising
    references[:, 1] = np.minimum(np.arange(rows), rising) * 1e-3
    angles = np.zeros((rows, 2)) if angles is None else angles
    record = stub(
        references_A=references,
        currents_A=references,
        angles_rad=angles,
        times_s=np.arange(rows) * 1e-3,
    )
    return DriveRun("a", "validate", record, 1000.0)


@pytest.mark.parametrize(("rising", "found"), [(19, None), (20, (1, pytest.approx(1.0)))])
def test_a_ramp_rises_for_twenty_rows(rising, found):
    assert ramps.ramp_of(ramp_run(rising=rising)) == found


@pytest.mark.parametrize(("counts", "moved"), [(2.4, False), (2.6, True)])
def test_a_motor_has_moved_by_two_counts_and_a_half(counts, moved):
    angles = np.zeros((100, 2))
    angles[60:, 1] = counts * STEP
    noise = stub(angle_std_rad=STEP / 12**0.5)
    time, torque = ramps._read(ramp_run(angles=angles), 1, noise, 0.06)
    assert np.isfinite(time) == moved
    if moved:
        assert time == pytest.approx(0.06)
        assert torque == pytest.approx(0.06 * 0.06)


@pytest.mark.parametrize(("times", "found"), [(4.9, 0), (5.1, 1)])
def test_angles_are_looked_at_where_they_move_by_five_of_the_poses_noise(monkeypatch, times, found):
    poses = np.tile([1.0, -1.0], 50)[:, None]
    seen = Seen(57.0 * poses, poses, None)
    seen.noise = np.array([1.0 / times])
    monkeypatch.setattr(mistaken_records, "_told", lambda *_: seen)
    assert len(mistaken_records._angles(session_of(), run_of())) == found


@pytest.mark.parametrize(("square", "steps"), [(2.1, 2), (1.9, 3)])
def test_a_search_may_end_early_from_twice_the_noise(square, steps):
    """A cost that falls by a twentieth with every step ends at once where it is a misfit."""
    costs = iter([square / 2.0, 0.99 * square / 2.0, 0.98 * square / 2.0])
    made = []

    def normal(x):
        made.append(x)
        return Normal(1000 * next(costs, 0.98 * square / 2.0), np.ones(1), np.ones((1, 1)), 1000)

    minimise(normal, np.zeros(1), most=2, misfit_gain=0.05)
    assert len(made) == steps


@pytest.mark.parametrize(("square", "lost"), [(9.5, False), (10.5, True)])
def test_a_head_is_lost_from_ten_times_its_noise(monkeypatch, square, lost):
    found = stub(normal=stub(cost=500.0 * square, n=1000))
    ended = stub(found=found, theta=None, offsets=None)
    monkeypatch.setattr(elastic_search, "estimate", lambda *_: ended)
    monkeypatch.setattr(elastic_search, "replace", lambda one, **_: one)
    monkeypatch.setattr(elastic_search, "head_of", lambda *_: None)
    run = stub(record=stub(times_s=np.zeros(1000)), rate_hz=1000.0)
    given = stub(runs=(run,))
    if lost:
        with pytest.raises(ValueError, match=r"first 0\.3 s of the runs are not explained"):
            elastic_search.followed(given, None, refit.HEAD_S, refit.LOST)
    else:
        assert elastic_search.followed(given, None, refit.HEAD_S, refit.LOST) is ended


def test_heads_of_elastic_cables_hold_one_turn_and_a_half_of_ten_a_second(monkeypatch):
    """A stiff cable swings ten times a second: below ten radians, above a whole turn."""
    heads, steps = [], []
    monkeypatch.setattr(elastic_search, "head_of", lambda run, seconds: heads.append(seconds))
    monkeypatch.setattr(elastic_search, "replace", lambda one, **_: one)

    class Nothing:
        def __init__(self, *_):
            pass

        def start(self):
            return None

        def normal(self, _):
            return stub(cost=0.0)

    monkeypatch.setattr(elastic_search, "Problem", Nothing)
    elastic_search.best_start(stub(runs=(None,)), None, [np.zeros(1)])
    assert 0.8 * 10.0 < 2.0 * np.pi * 10.0 * heads[0] < 10.0
    found = stub(normal=stub(cost=0.0, n=1000))
    ended = stub(found=found, theta=None, offsets=None)

    def estimate(_given, _asked, most=60):
        steps.append(most)
        return ended

    monkeypatch.setattr(elastic_search, "estimate", estimate)
    run = stub(record=stub(times_s=np.zeros(400)), rate_hz=1000.0)
    elastic_search.followed(stub(runs=(run,)), None)
    assert steps == [10, 10, 60], "two heads of ten steps, and all of it to the end"


@pytest.mark.parametrize(("stretch", "simulations"), [(None, 1), (0, 4)])
def test_starts_of_elastic_cables_take_one_step_more_than_micrometres(
    monkeypatch, stretch, simulations
):
    """A step leaves a thirtieth: of 30 mm the third leaves one micrometre, and one more is made."""
    count, heads = [], []
    model = stub(n_cables=1)
    noise = stub(current_std_A=1.0)
    run = stub(record=stub(currents_A=np.zeros((1, 1))))
    monkeypatch.setattr(predicted_run, "head_of", lambda run, seconds: heads.append(seconds))
    monkeypatch.setattr(predicted_run, "start_pose", lambda *_: np.zeros(7))
    monkeypatch.setattr(predicted_run, "moved", lambda pose, _: pose)
    monkeypatch.setattr(predicted_run, "stretch_of", lambda *_: stretch)
    monkeypatch.setattr(predicted_run, "simulated", lambda *_: count.append(1))
    slopes = (np.eye(7)[None], np.zeros((0, 7)))
    seen = stub(slopes=slopes, angles=np.zeros(7), poses=np.zeros(0))
    monkeypatch.setattr(predicted_run, "compared", lambda *_: seen)
    predicted_run._start(stub(model=model, noise=noise), run, None, None)
    assert len(count) == simulations
    assert heads == pytest.approx([0.3], rel=0.15)


def test_a_second_start_is_five_percent_off(monkeypatch):
    moved = []
    dynamic = stub(put=lambda model, theta, values: moved.append(values))
    monkeypatch.setattr(identify, "replace", lambda one, **_: one)
    monkeypatch.setattr(identify, "estimate", lambda *_: None)
    monkeypatch.setattr(identify, "apart", lambda *_: 0.0)
    first = stub(values=np.ones(4), theta=None)
    identify._second_start(stub(model=None), stub(dynamic=dynamic), first)
    np.testing.assert_allclose(np.abs(moved[0] - 1.0), 0.05, rtol=0.1)


@pytest.mark.parametrize(("left", "held"), [(0.9e-9, True), (1.1e-9, False)])
def test_a_column_that_others_make_is_held(left, held):
    slopes = np.array([[1.0, 1.0], [0.0, left]])
    model = stub(index=lambda name: ("added", "asked").index(name))
    asked = stub(groups=[stub(name="asked", members=("asked",))])
    assert added_effects._held(model, asked, ("added",), slopes) == (("asked",) if held else ())


def test_poses_at_rest_are_means_of_a_hundred_samples(monkeypatch):
    monkeypatch.setattr(plan_poses, "static_pose", lambda *_: stub(pose=np.zeros(7)))
    monkeypatch.setattr(plan_poses, "motor_angles", lambda *_: None)
    noise = stub(pose_std=np.ones(6), angle_std_rad=1.0)
    bench = stub(model=stub(declared=None), noise=noise)
    std = plan_poses.at_rest(bench, np.zeros((1, 1))).pose_std
    np.testing.assert_allclose(std, 0.1, rtol=0.1)


def test_at_most_four_motors_hold_an_added_pose(monkeypatch):
    rest = stub(pose=None, tensions_N=None)
    monkeypatch.setattr(plan_poses, "static_pose", lambda *_: rest)
    monkeypatch.setattr(plan_poses, "within", lambda *_: True)
    drive = stub(current_limits_A=np.tile([0.0, 9.0], (8, 1)))
    bench = stub(model=stub(n_cables=8, drive=drive))
    together = np.count_nonzero(plan_poses._tried(bench, None, 0), axis=1)
    assert together.min() == 1
    assert together.max() == 4


@pytest.mark.parametrize(("times", "told"), [(1.4, 0), (1.6, 1)])
def test_residuals_above_their_noise_are_said(times, told):
    """Counts that stand still make 1.1 of a right model's; a half more is something else."""
    said = []
    found = stub(output_error=None, joint=stub(second_start_z=0.0))
    left = stub(times_noise={"a": times})
    document = stub(slack=(), saturated=(), residual=left, estimates=found)
    drive_command._warn(document, stub(complain=said.append))
    assert len(said) == told
