"""What checks of driven recordings decide, on both sides of every limit, without any robot."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.ident.drive.records import mistaken_records


def stub(**more: object) -> Any:
    """What a test needs of a session, a run or a model, and no more."""
    return SimpleNamespace(**more)


STEP = 1e-3  # rad between counts, whose noise is STEP / sqrt(12)


def session_of(n=1, limit_A=3.0, **more):
    cables = [stub(name=str(k + 1)) for k in range(n)]
    model = stub(
        robot=stub(cables=cables),
        drive=stub(current_limits_A=np.array([[0.0, limit_A]] * n)),
        names=(),
        declared=np.zeros(0),
    )
    noise = stub(angle_std_rad=STEP / 12**0.5, latency_s=0.01)
    return stub(model=model, noise=noise, **more)


def run_of(**record):
    record = {"seen": np.arange(100), **record}
    return stub(name="a", rate_hz=1000.0, record=stub(**record))


class Seen(tuple):
    """What encoders and poses tell of the angles, and what the poses' own noise makes of it."""

    read: np.ndarray
    told: np.ndarray
    speed: np.ndarray
    noise: np.ndarray

    def __new__(cls, read, told, speed):
        seen = super().__new__(cls, (read, told, speed))
        seen.read, seen.told, seen.speed = read, told, speed
        seen.noise = np.zeros(read.shape[1])
        return seen


def told(monkeypatch, read, poses, speed=None):
    monkeypatch.setattr(mistaken_records, "_told", lambda *_: Seen(read, poses, speed))


@pytest.mark.parametrize(("gap", "found"), [(1.45, 0), (1.55, 1)])
def test_a_jump_is_half_a_period(gap, found):
    times = 1e-3 * np.cumsum(np.r_[np.ones(50), gap, np.ones(50)])
    assert len(mistaken_records._times(run_of(times_s=times))) == found


@pytest.mark.parametrize(("slow", "found"), [(1.009, 0), (1.011, 1)])
def test_a_rate_is_another_from_one_per_cent(slow, found):
    assert len(mistaken_records._times(run_of(times_s=1e-3 * slow * np.arange(100)))) == found


@pytest.mark.parametrize(("largest", "found"), [(29.0, 0), (31.0, 1)])
def test_milliampere_are_thirty_times_the_limit(monkeypatch, largest, found):
    currents = np.linspace(0.0, 3.0 * largest, 100)[:, None]
    monkeypatch.setattr(mistaken_records, "flowing", lambda *_: currents)
    run = run_of(currents_A=currents, references_A=currents)
    assert len(mistaken_records._currents(session_of(), run)) == found


@pytest.mark.parametrize(("share", "found"), [(0.48, 0), (0.52, 1)])
def test_a_current_that_does_not_follow_is_off_by_half_its_scatter(monkeypatch, share, found):
    flows = np.tile([0.0, 1.0, 1.0, 0.0], 25)[:, None]
    off = share * np.tile([0.5, 0.5, -0.5, -0.5], 25)[:, None]
    monkeypatch.setattr(mistaken_records, "flowing", lambda *_: flows)
    run = run_of(currents_A=flows + off, references_A=flows)
    assert len(mistaken_records._currents(session_of(), run)) == found


@pytest.mark.parametrize(
    ("slope", "words"),
    [
        (29.0, ""),
        (31.0, "degrees?"),
        (109.0, "degrees?"),
        (111.0, ""),
        (148.0, ""),
        (152.0, "counts?"),
    ],
)
def test_units_of_angles_are_slopes(monkeypatch, slope, words):
    poses = np.sin(np.arange(100.0))[:, None]
    told(monkeypatch, slope * poses, poses)
    found = mistaken_records._angles(session_of(), run_of())
    assert bool(found) == bool(words), found
    assert words in "".join(found)


@pytest.mark.parametrize(("steps", "found"), [(19.0, 0), (21.0, 1)])
def test_angles_that_hardly_move_tell_no_unit(monkeypatch, steps, found):
    """A motion of so many deviations of the counts' noise, in degrees."""
    poses = np.tile([1.0, -1.0], 50)[:, None] * steps * STEP / 12**0.5
    told(monkeypatch, 57.0 * poses, poses)
    assert len(mistaken_records._angles(session_of(), run_of())) == found


@pytest.mark.parametrize(("travel", "found"), [(19.0, 1), (21.0, 0)])
def test_a_run_of_twenty_counts_excites_something(travel, found):
    run = run_of(angles_rad=STEP * np.linspace(0.0, travel, 100)[:, None])
    assert len(mistaken_records._still(session_of(), run)) == found


def mixed(own, other):
    """Two motions, and readings of the first motor that correlate so with each."""
    a, b = np.tile([1.0, 1.0, -1.0, -1.0], 25), np.tile([1.0, -1.0, -1.0, 1.0], 25)
    rest = np.tile(np.r_[np.ones(20), -np.ones(20)], 5)[:100]
    rest = rest - rest @ a / 100.0 * a - rest @ b / 100.0 * b - rest.mean()
    rest *= 10.0 / np.linalg.norm(rest)
    left = np.sqrt(max(1.0 - own**2 - other**2, 0.0))
    return np.column_stack([a, b]), own * a + other * b + left * rest, b


@pytest.mark.parametrize(("own", "found"), [(0.89, 1), (0.91, 0), (-0.91, 1)])
def test_an_angle_follows_its_cable(monkeypatch, own, found):
    poses, first, second = mixed(own, 0.0)
    told(monkeypatch, np.column_stack([first, second]), poses)
    said = mistaken_records._angles(session_of(2), run_of())
    assert len(said) == found, said
    assert ("turn its sign" in "".join(said)) == (own < -0.9)


@pytest.mark.parametrize(("other", "words"), [(0.965, "does not follow"), (0.975, "swapped")])
def test_columns_are_swapped_where_each_follows_the_other(monkeypatch, other, words):
    poses, first, _ = mixed(0.0, other)
    told(monkeypatch, np.column_stack([first, poses[:, 0]]), poses)
    said = mistaken_records._angles(session_of(2), run_of())
    assert any(words in text for text in said), said
    assert any("swapped" in text for text in said) == (words == "swapped"), said


@pytest.mark.parametrize(("delay", "found"), [(0.0029, 0), (0.0031, 1), (-0.0031, 1)])
def test_poses_are_late_from_three_milliseconds(monkeypatch, delay, found):
    times = np.arange(100) / 100.0
    poses, speed = np.sin(6.0 * times)[:, None], 6.0 * np.cos(6.0 * times)[:, None]
    told(monkeypatch, poses + delay * speed, poses, speed)
    assert len(mistaken_records._latency(session_of(), run_of())) == found


@pytest.mark.parametrize(
    ("counts", "place", "found"), [(2.9, 4, 0), (3.1, 4, 1), (9.0, 3, 0), (9.0, 5, 0)]
)
def test_a_start_in_motion_turns_by_three_counts_in_four_milliseconds(counts, place, found):
    angles = np.zeros((100, 1))
    angles[place] = counts * STEP
    still = np.zeros((100, 1))
    run = run_of(angles_rad=angles, references_A=still, currents_A=still)
    assert len(mistaken_records._start(session_of(), run)) == found


@pytest.mark.parametrize(("square", "found"), [(59.0, 0), (61.0, 1)])
def test_a_static_row_is_odd_from_sixty(monkeypatch, square, found):
    rows = np.zeros((6, 1))
    static = stub(poses=rows, currents_A=rows, angles_rad=rows)
    asked = stub(kinematic=stub(groups=("drum",)))
    squares = np.r_[14.0 * np.ones(5), square]
    monkeypatch.setattr(mistaken_records, "_static_squares", lambda *_: squares)
    monkeypatch.setattr(mistaken_records, "replace", lambda one, **_: one)
    assert len(mistaken_records._static(session_of(static=static, asked=asked))) == found
