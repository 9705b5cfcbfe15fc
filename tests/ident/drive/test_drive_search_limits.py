"""Limits of slack, ramps and searches of driven robots, on both sides, without any robot."""

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.ident.drive import checks, elastic_search, ramps, slack
from freeswing.ident.drive.diagnose import refit
from freeswing.ident.drive.run_problem import DriveRun
from freeswing.ident.drive.solver import Normal, minimise
from tests.ident.drive.test_drive_limits import Seen, run_of, session_of

STEP = 1e-3


def motion_of(pushing, rate_hz=1000.0):
    times = np.arange(len(pushing)) / rate_hz
    return SimpleNamespace(times_s=times, slack=np.array(pushing)[:, None], lengths_out_m=None)


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
    robot = SimpleNamespace(cables=[SimpleNamespace(name="1")])
    run = SimpleNamespace(name="a", rate_hz=1000.0)
    if kept is None:
        with pytest.raises(ValueError, match=r"cable 1 is slack from 0\.5"):
            slack.before_slack(SimpleNamespace(robot=robot), None, (run,), None)
    else:
        assert slack.before_slack(SimpleNamespace(robot=robot), None, (run,), None) == (kept,)


def ramp_run(rows=100, rising=None, angles=None):
    references = np.zeros((rows, 2))
    rising = rows - 1 if rising is None else rising
    references[:, 1] = np.minimum(np.arange(rows), rising) * 1e-3
    angles = np.zeros((rows, 2)) if angles is None else angles
    record = SimpleNamespace(
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
    noise = SimpleNamespace(angle_std_rad=STEP / 12**0.5)
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
    monkeypatch.setattr(checks, "_told", lambda *_: seen)
    assert len(checks._angles(session_of(), run_of())) == found


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
    found = SimpleNamespace(normal=SimpleNamespace(cost=500.0 * square, n=1000))
    ended = SimpleNamespace(found=found, theta=None, offsets=None)
    monkeypatch.setattr(elastic_search, "estimate", lambda *_: ended)
    monkeypatch.setattr(elastic_search, "replace", lambda one, **_: one)
    monkeypatch.setattr(elastic_search, "head_of", lambda *_: None)
    run = SimpleNamespace(record=SimpleNamespace(times_s=np.zeros(1000)), rate_hz=1000.0)
    given = SimpleNamespace(runs=(run,))
    if lost:
        with pytest.raises(ValueError, match=r"first 0\.3 s of the runs are not explained"):
            elastic_search.followed(given, None, refit.HEAD_S, refit.LOST)
    else:
        assert elastic_search.followed(given, None, refit.HEAD_S, refit.LOST) is ended
