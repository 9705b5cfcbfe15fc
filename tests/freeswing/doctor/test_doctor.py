"""What the doctor says on both sides of each of its limits."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.doctor.footage import calibration_findings
from freeswing.doctor.robot_file.units_and_places import robot_findings
from freeswing.doctor.run_roles import split_findings
from freeswing.doctor.run_samples import run_findings
from freeswing.doctor.time_stamps import refuse_wrong_stamps
from freeswing.ident.runs import SwingRun
from freeswing.session.session_file import read_session
from tests.oracle.scenes.robots import declared_robot
from tests.places import SAMPLES

ROBOT = declared_robot("bologna-4")
REST = np.array([1.2, -0.2, -0.9, 0.0, 0.0, 0.0])


def told(findings, words):
    """The levels of the findings whose text holds these words."""
    return [one.level for one in findings if words in one.text]


def robot(**changes):
    first, *others = ROBOT.cables
    return replace(ROBOT, cables=(replace(first, **changes), *others))


@pytest.mark.parametrize(
    ("changes", "words", "levels"),
    [
        ({"entry_m": np.array([199.0, 0.0, 0.0])}, "entry_m reaches", []),
        ({"entry_m": np.array([201.0, 0.0, 0.0])}, "entry_m reaches", ["error"]),
        ({"attachment_m": np.array([19.9, 0.0, 0.0])}, "attachment_m reaches", []),
        ({"attachment_m": np.array([20.1, 0.0, 0.0])}, "attachment_m reaches", ["error"]),
        ({"pulley_radius_m": 0.49}, "pulley_radius_m reaches", []),
        ({"pulley_radius_m": 0.51}, "pulley_radius_m reaches", ["error"]),
        (
            {"entry_m": ROBOT.cables[1].entry_m + np.array([0.0, 0.0, 0.0011])},
            "the same entry_m",
            [],
        ),
        (
            {"entry_m": ROBOT.cables[1].entry_m + np.array([0.0, 0.0, 0.0009])},
            "the same entry_m",
            ["note"],
        ),
    ],
)
def test_robots(changes, words, levels) -> None:
    assert told(robot_findings(robot(**changes)), words) == levels


@pytest.mark.parametrize(
    ("size", "levels"),
    [(9.69, ["warning"]), (9.71, []), (9.89, []), (9.91, ["warning"]), (1.62, ["warning"])],
)
def test_gravity(size, levels) -> None:
    found = robot_findings(replace(ROBOT, gravity_m_s2=np.array([0.0, 0.0, -size])))
    assert told(found, "gravity is") == levels


def swing(values=None, times=None, **changes):
    """A platform that shakes by 1 mm along the direction in which cables hardly change."""
    times = np.arange(0.0, 6.005, 0.01) if times is None else times
    if values is None:
        values = np.tile(REST, (len(times), 1))
        values[:, 0] += 5e-4 * np.sin(4.0 * times)
    run = SwingRun("s", "identify", Trajectory(times, POSE_COORDINATES, values))
    return replace(run, **({"window_s": (0.0, 6.0)} | changes))


def said(run, words, rate_hz=None):
    return told(run_findings(run, ROBOT, rate_hz), words)


@pytest.mark.parametrize(
    ("share", "levels"),
    [(6.4e-4, []), (-6.4e-4, []), (7.0e-4, ["warning"]), (-7.0e-4, ["warning"])],
)
def test_rates(share, levels) -> None:
    """Half a thousandth, and a millisecond of rounded stamps over six seconds."""
    assert said(swing(), "the session says", 100.0 / (1.0 + share)) == levels


@pytest.mark.parametrize(
    ("factor", "levels"),
    [
        (1.0031, ["warning"]), (1.0033, ["error"]), (0.9969, ["warning"]), (0.9967, ["error"]),
        (2.0, ["warning"]), (0.5, ["warning"]), (1.5, ["error"]),
    ],
)  # fmt: skip
def test_rates_that_contradict_each_other(factor, levels) -> None:
    """Three thousandths and the rounding, but for whole parts of a rate."""
    run = swing()
    assert said(run, "the session says", 100.0 / factor) == levels
    filmed = run_findings(run, ROBOT, 100.0 / factor, measured=False)
    assert told(filmed, "the session says") == ["warning"]
    if levels == ["error"]:
        with pytest.raises(DataError, match="one of the two clocks is wrong"):
            refuse_wrong_stamps([run], 100.0 / factor)
    else:
        refuse_wrong_stamps([run], 100.0 / factor)


def counted_on(lost: int) -> SwingRun:
    """A swing that lost rows where it was fast, its stamps counted on."""
    run = swing()
    values = run.trajectory.values.copy()
    values[:, 0] += 3e-7 * np.random.default_rng(2).normal(size=len(values))
    keep = np.ones(len(values), dtype=bool)
    keep[[80, 160, 238][:lost]] = False
    return swing(values[keep], run.trajectory.times_s[: keep.sum()], window_s=None)


@pytest.mark.parametrize(("lost", "levels"), [(0, []), (2, ["warning"]), (3, ["error"])])
def test_rows_that_were_lost_while_stamps_were_counted_on(lost, levels) -> None:
    run = counted_on(lost)
    assert said(run, "rows were lost and the stamps counted on") == levels
    refuse_wrong_stamps([counted_on(2)], None)
    with pytest.raises(DataError, match=r"run s \(and 1 more run\): 2 steps, the first at 0.80 s"):
        refuse_wrong_stamps([counted_on(0), counted_on(2), counted_on(1)], None)


@pytest.mark.parametrize(("step", "levels"), [(1.45, []), (1.55, ["note"])])
def test_jumps_of_the_stamps(step, levels) -> None:
    times = np.arange(0.0, 6.005, 0.01)
    times[300:] += 0.01 * (step - 1.0)
    assert said(swing(times=times), "time stamps jump") == levels


@pytest.mark.parametrize(("count", "levels"), [(8, []), (7, ["error"])])
def test_few_samples(count, levels) -> None:
    run = swing(times=0.01 * np.arange(count), window_s=None)
    assert said(run, "at least 8 are needed") == levels


@pytest.mark.parametrize(("end_s", "levels"), [(5.01, []), (4.99, ["warning"])])
def test_short_windows(end_s, levels) -> None:
    assert said(swing(window_s=(0.0, end_s)), "s of free motion") == levels


@pytest.mark.parametrize(("hidden", "levels"), [(29, []), (31, ["warning"])])
def test_missing_samples(hidden, levels) -> None:
    """Every other sample of a stretch: many, but no long gap; 5 % of 601 are 30."""
    run = swing()
    values = run.trajectory.values.copy()
    values[10 : 10 + 2 * hidden : 2] = np.nan
    assert said(swing(values), "samples are missing") == levels


@pytest.mark.parametrize(("hidden", "levels"), [(8, []), (10, ["warning"])])
def test_long_gaps(hidden, levels) -> None:
    run = swing()
    values = run.trajectory.values.copy()
    values[100 : 100 + hidden] = np.nan
    assert said(swing(values), "the longest gap") == levels


@pytest.mark.parametrize(("x_m", "levels"), [(99.0, []), (101.0, ["error"])])
def test_places_far_away(x_m, levels) -> None:
    values = np.tile(REST, (601, 1))
    values[:, 0] = x_m
    assert said(swing(values), "the pulleys lie within") == levels


@pytest.mark.parametrize(("x_m", "levels"), [(1990.0, []), (2010.0, ["error"])])
def test_places_far_beyond_large_frames(x_m, levels) -> None:
    large = robot(entry_m=np.array([100.0, 0.0, 0.0]))
    values = np.tile(REST, (601, 1))
    values[:, 0] = x_m
    assert told(run_findings(swing(values), large, None), "the pulleys lie within") == levels


@pytest.mark.parametrize(("std_m", "levels"), [(1.1e-4, []), (0.9e-4, ["warning"])])
def test_platforms_that_stand(std_m, levels) -> None:
    values = np.tile(REST, (600, 1))
    values[::2, 0] += std_m
    values[1::2, 0] -= std_m
    run = swing(values, times=0.01 * np.arange(600))
    assert said(run, "hardly moves") == levels


def lengths(poses):
    model = build_model(ROBOT)
    return evaluate(model.lengths, poses, model.start_values)[0]


@pytest.mark.parametrize(("change_m", "named"), [(0.0029, False), (0.0031, True)])
def test_cables_that_change(change_m, named) -> None:
    """The platform sinks until its first cable is so much longer, half-way."""
    slope = (lengths(REST - [0, 0, 1e-4, 0, 0, 0])[0] - lengths(REST)[0]) / 1e-4
    values = np.tile(REST, (601, 1))
    values[300:, 2] -= change_m / slope
    found = [one.text for one in run_findings(swing(values), ROBOT, None)]
    assert any("cable 1's length changes" in text for text in found) == named, found


@pytest.mark.parametrize(("off_m", "levels"), [(0.0195, []), (0.0205, ["warning"])])
def test_told_lengths(off_m, levels) -> None:
    values = np.tile(REST, (601, 1))
    told_m = lengths(REST).ravel() - np.array([off_m, 0.0, 0.0, 0.0])
    assert said(swing(values, lengths_m=told_m), "from its cable_lengths_m") == levels


SESSION = """format = "freeswing-session/1"
name = "s"
robot = "robot.toml"
"""


@pytest.mark.parametrize(("count", "levels"), [(2, ["warning"]), (3, [])])
def test_few_runs_to_identify(tmp_path, count, levels) -> None:
    text = SESSION
    for k in range(count + 1):
        role = "identify" if k < count else "validate"
        text += f'[[runs]]\nname = "r{k}"\nrole = "{role}"\ntrajectory = "r{k}.csv"\n'
        (tmp_path / f"r{k}.csv").write_text(f"{k}\n", encoding="utf-8")
    (tmp_path / "session.toml").write_text(text, encoding="utf-8")
    found = split_findings(read_session(tmp_path), [])
    assert told(found, "identify runs") == levels


@pytest.mark.parametrize(
    ("second", "levels"),
    [(None, ["error"]), ((5.1, 15.1), ["warning"]), ((4.9, 14.9), ["error"]), ((10.0, 20.0), [])],
)
def test_one_recording_in_two_runs(tmp_path, second, levels) -> None:
    """What identify refuses is no mere warning: half of the shorter run in both."""
    text = SESSION
    (tmp_path / "a.csv").write_text("1\n", encoding="utf-8")
    for k, window in enumerate(((0.0, 10.0), second)):
        text += f'[[runs]]\nname = "r{k}"\nrole = "identify"\ntrajectory = "a.csv"\n'
        text += "" if second is None else f"window_s = {list(window)}\n"
    (tmp_path / "session.toml").write_text(text, encoding="utf-8")
    found = split_findings(read_session(tmp_path), [])
    assert told(found, "the same recording") == levels


@pytest.mark.parametrize(("side_m", "levels"), [(0.99, []), (1.01, ["error"])])
def test_boards_in_millimetres(side_m, levels, tmp_path) -> None:
    """By name and key, before anything is calibrated."""
    shutil.copytree(SAMPLES / "filmed", tmp_path, dirs_exist_ok=True)
    path = tmp_path / "session.toml"
    text = path.read_text(encoding="utf-8")
    text = re.sub(r"square_m = [\d.]+", f"square_m = {side_m}", text)
    path.write_text(text, encoding="utf-8")
    found = list(calibration_findings(read_session(tmp_path)))
    assert told(found, f"square_m is {side_m} m: lengths are in metres") == levels
    assert all(one.subject == "calibration.board" for one in found if one.level == "error")
