"""Orientations that were meant otherwise: named with the remedy, before anything is fitted."""

from __future__ import annotations

import shutil
from dataclasses import replace
from itertools import chain, repeat
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.measured.quaternion_readings import READINGS
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import build_model
from freeswing.doctor import recordings_against_lengths
from freeswing.doctor.recordings_against_lengths import mistaken_recording
from freeswing.ident.runs import SwingRun
from freeswing.main import main
from tests.places import SAMPLES

SAMPLE = SAMPLES / "three-cables"
ROBOT = read_robot(SAMPLE / "robot.toml")
ORDERS = {"wxyz": [0, 1, 2, 3], "xyzw": [1, 2, 3, 0]}


def written(path: Path, order: str, inverse: bool) -> None:
    """A run's file again, its quaternions in another order or those of the inverse."""
    lines = path.read_text(encoding="utf-8").splitlines()
    rows = [line.split(",") for line in lines[1:]]
    made = [lines[0]]
    for row in rows:
        q = [row[4], *(str(-float(c)) if inverse and c else c for c in row[5:8])]
        made.append(",".join([*row[:4], *(q[k] for k in ORDERS[order]), *row[8:]]))
    path.write_text("\n".join(made) + "\n", encoding="utf-8")


@pytest.mark.parametrize(
    ("order", "inverse", "said"),
    [
        ("xyzw", False, "quaternions stand as x y z w:"),
        ("wxyz", True, "orientations are those of the base in the platform:"),
        ("xyzw", True, "quaternions stand as x y z w, of the base in the platform:"),
    ],
)
def test_each_is_named(order: str, inverse: bool, said: str, tmp_path: Path) -> None:
    path = tmp_path / "swing-01.csv"
    shutil.copy(SAMPLE / "runs" / "swing-01.csv", path)
    written(path, order, inverse)
    run = SwingRun("swing-01", "identify", read_trajectory(path))
    found, remedy = mistaken_recording(run, ROBOT)
    assert found.startswith(said), found
    assert remedy == READINGS[said[:-1]][1]


@pytest.mark.parametrize("command", ["check", "identify", "diagnose"])
def test_commands_name_it(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(SAMPLE, tmp_path / "session")
    for path in (tmp_path / "session" / "runs").glob("*.csv"):
        written(path, "xyzw", False)
    assert main([command, str(tmp_path / "session")]) == 1
    told = capsys.readouterr()
    assert "run swing-01" in told.out + told.err
    assert "quaternions stand as x y z w: cable lengths are off by" in told.out + told.err
    assert "write w into qw" in told.out + told.err


def test_what_is_right_and_what_is_merely_wrong_is_not_named() -> None:
    right = SwingRun("a", "identify", read_trajectory(SAMPLE / "runs" / "swing-01.csv"))
    assert mistaken_recording(right, ROBOT) == ("", "")
    seen = right.trajectory
    moved = Trajectory.from_poses(seen.times_s, seen.positions() + 0.3, seen.rotations())
    far = replace(right, trajectory=moved, lengths_m=np.array([1.0, 1.0, 1.0]))
    assert mistaken_recording(far, ROBOT) == ("", "")


def test_cables_with_ends_of_each_other_and_a_turned_platform_are_named() -> None:
    """Exchanged entries had been called exchanged attachments, which left 14 mm."""
    run = SwingRun("a", "identify", read_trajectory(SAMPLE / "runs" / "swing-01.csv"))
    one, two, three = ROBOT.cables
    for key, do in (("entry_m", "swivel axes"), ("attachment_m", "with its entry")):
        ends = [{key: getattr(cable, key)} for cable in (two, one)]
        swapped = replace(ROBOT, cables=(replace(one, **ends[0]), replace(two, **ends[1]), three))
        said, remedy = mistaken_recording(run, swapped)
        assert said.startswith(f"robot.toml has {key} of cables {one.name}, {two.name} in each")
        assert do in remedy
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    cables = tuple(replace(cable, attachment_m=turn @ cable.attachment_m) for cable in ROBOT.cables)
    said, remedy = mistaken_recording(run, replace(ROBOT, cables=cables))
    assert said.startswith("robot.toml has all attachment_m in a frame that is turned"), said
    assert "the frame of the platform" in remedy


@pytest.mark.parametrize(
    ("key", "meant", "said"),
    [
        ("attachment_m", lambda p: p * [1.0, -1.0, 1.0], "the sign of y turned in attachment_m"),
        ("attachment_m", lambda p: p[[1, 0, 2]], "x and y exchanged in attachment_m"),
        ("entry_m", lambda p: p[[0, 2, 1]], "y and z exchanged in entry_m"),
        ("entry_m", lambda p: p * [0.1, 1.0, 1.0], "x ten times too small in entry_m"),
        ("entry_m", lambda p: p * [1.0, 10.0, 1.0], "y ten times too large in entry_m"),
    ],
)
def test_a_slip_in_one_end_of_one_cable_is_named(key, meant, said) -> None:
    """All runs had been left out, their cable slack."""
    run = SwingRun("a", "identify", read_trajectory(SAMPLE / "runs" / "swing-01.csv"))
    one, *others = ROBOT.cables
    wrong = replace(one, **{key: meant(np.array(getattr(one, key)))})
    told, remedy = mistaken_recording(run, replace(ROBOT, cables=(wrong, *others)))
    assert told.startswith(f"robot.toml has {said} of cable {one.name}"), told
    assert remedy == "correct it"


def test_an_end_that_is_elsewhere_is_no_slip() -> None:
    """Displaced by 40 to 200 mm anyhow, and a slip that is near leaves a tenth."""
    run = SwingRun("a", "identify", read_trajectory(SAMPLE / "runs" / "swing-01.csv"))
    one, *others = ROBOT.cables
    rng = np.random.default_rng(7)
    for key in ("entry_m", "attachment_m"):
        for size in (0.04, 0.1, 0.2, 0.2, 0.2):
            step = rng.normal(size=3)
            moved = np.array(getattr(one, key)) + size * step / np.linalg.norm(step)
            robot = replace(ROBOT, cables=(replace(one, **{key: moved}), *others))
            assert mistaken_recording(run, robot) == ("", "")


@pytest.mark.parametrize(
    ("cable", "off_m"), [(0, 0.768), (0, -0.527), (1, -0.447), (1, 0.3), (2, 0.456)]
)
def test_a_length_that_is_stated_wrong_is_no_slip(cable: int, off_m: float) -> None:
    """One in twenty wrong ones up to 1 m had been a slip in an entry or an attachment."""
    run = SwingRun("a", "identify", read_trajectory(SAMPLE / "runs" / "swing-01.csv"))
    model = build_model(ROBOT)
    lengths = evaluate(model.lengths, run.inside().values, model.start_values)[0].reshape(-1, 3)
    stated = np.nanmean(lengths, axis=0) + off_m * np.eye(3)[cable]
    assert mistaken_recording(replace(run, lengths_m=stated), ROBOT) == ("", "")


@pytest.mark.parametrize(("left", "named"), [(0.049, True), (0.051, False)])
def test_what_a_slip_may_leave(monkeypatch, left, named) -> None:
    room = "freeswing.doctor.recordings_against_lengths"
    off, meant = chain([1.0], repeat(0.3)), build_model(ROBOT)
    monkeypatch.setattr(
        f"{room}._lengths_off",
        lambda model, *_: left * 0.2 if model is meant else next(off) * 0.2,
    )
    still = Trajectory.from_poses(np.arange(9.0), np.zeros((9, 3)), np.tile(np.eye(3), (9, 1, 1)))
    slip = recordings_against_lengths._Reading(
        still, meant, ("a slip",), ("correct it",), None, is_slip=True
    )
    for name in ("_orders", "_turns", "_readings"):
        monkeypatch.setattr(f"{room}.{name}", lambda *_: iter(()))
    monkeypatch.setattr(f"{room}._slips", lambda *_: iter([slip]))
    monkeypatch.setattr(f"{room}.build_model", lambda _: None)
    assert bool(mistaken_recording(SwingRun("a", "identify", still), ROBOT)[0]) == named


@pytest.mark.parametrize(
    ("off_m", "left_m", "named"),
    [
        (0.0205, 0.001, True),
        (0.0195, 0.001, False),
        (0.1, 0.0195, True),
        (0.1, 0.0205, False),
        (1.0, 0.0195, True),
        (1.0, 0.0205, False),
    ],
)
def test_what_is_left_by_the_right_reading(monkeypatch, off_m, left_m, named) -> None:
    """Lengths off by 2 cm, of which the right reading leaves a fifth and 2 cm at most."""
    off = chain([off_m, left_m], repeat(off_m))
    monkeypatch.setattr(
        "freeswing.doctor.recordings_against_lengths._lengths_off", lambda *_: next(off)
    )
    monkeypatch.setattr("freeswing.doctor.recordings_against_lengths._orders", lambda *_: iter(()))
    monkeypatch.setattr("freeswing.doctor.recordings_against_lengths._slips", lambda *_: iter(()))
    monkeypatch.setattr("freeswing.doctor.recordings_against_lengths.build_model", lambda _: None)
    still = Trajectory.from_poses(np.arange(9.0), np.zeros((9, 3)), np.tile(np.eye(3), (9, 1, 1)))
    assert bool(mistaken_recording(SwingRun("a", "identify", still), ROBOT)[0]) == named


def test_a_driven_session_is_told_so_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its pose latency was blamed."""
    shutil.copytree(SAMPLES / "inca-6d", tmp_path / "driven")
    for path in (tmp_path / "driven" / "runs").glob("*.csv"):
        rows = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines()]
        first = rows[0].index("qw")
        for row in rows[1:]:
            row[first : first + 4] = [row[first + k] for k in (1, 2, 3, 0)]
        path.write_text("\n".join(",".join(row) for row in rows) + "\n", encoding="utf-8")
    assert main(["check", str(tmp_path / "driven")]) == 1
    told = capsys.readouterr()
    assert "run ident: quaternions stand as x y z w" in told.out + told.err
    assert "write w into qw" in told.out + told.err
    assert "latency" not in told.out + told.err


@pytest.mark.parametrize("command", ["check", "identify", "diagnose"])
def test_one_column_in_millimetres_is_a_unit_and_no_slack_cable(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(SAMPLE, tmp_path / "session")
    path = tmp_path / "session" / "runs" / "swing-01.csv"
    head, *rows = path.read_text(encoding="utf-8").splitlines()
    cells = [row.split(",") for row in rows]
    z = head.split(",").index("z_m")
    for row in cells:
        row[z] = repr(1e3 * float(row[z])) if row[z] else ""
    path.write_text("\n".join([head, *map(",".join, cells)]) + "\n", encoding="utf-8")
    assert main([command, str(tmp_path / "session")]) == 1
    said = "".join(capsys.readouterr())
    assert "run swing-01" in said
    assert "z reaches 895" in said
    assert "write metres" in said
    assert "slack" not in said
