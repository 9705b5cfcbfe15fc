"""Cable lengths stated for one another's cables: named before anything is fitted to them."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.files.trajectory_csv import write_csv
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import POSE_COORDINATES, Cable, Robot
from freeswing.doctor.bench_runs import refuse_wrong_bench_runs
from freeswing.doctor.exchanged_by_lean import exchanged_by_lean, leans_shown
from freeswing.ident.bench.runs import Bench, BenchRun, Signal
from freeswing.ident.runs import SwingRun
from freeswing.main import main
from freeswing.session import exchanged_lengths
from freeswing.session.exchanged_lengths import (
    BENCH_DIFFERENCE_M,
    exchanged_at_rest,
    exchanged_sentence,
    pose_lengths,
    refuse_exchanged_lengths,
)
from freeswing.session.load_swings import load_swings
from freeswing.session.session_file import read_session
from tests.oracle.scenes.robots import declared_robot
from tests.places import SAMPLES

ROBOT = declared_robot("bologna-4")
OWN = np.array([1.5, 1.6, 1.7, 1.8])


def said_of(stated: np.ndarray) -> str:
    motion = Trajectory(np.arange(2.0), ("x",), np.zeros((2, 1)))
    return exchanged_sentence(SwingRun("a", "identify", motion, stated), ROBOT, OWN)


def test_exchanged_lengths_are_named() -> None:
    names = [cable.name for cable in ROBOT.cables]
    said = said_of(OWN[[2, 1, 0, 3]] + 1e-3)
    assert f"lengths of cables {names[0]} and {names[2]} are exchanged" in said
    assert "201 mm off as stated, 1.0 mm in each other's place" in said
    assert "are exchanged" in said_of(OWN[[1, 2, 3, 0]])  # all by one place


@pytest.mark.parametrize("off_m", [0.0, 1e-3, 0.09, -0.3])
def test_lengths_that_are_merely_wrong_are_another_matter(off_m: float) -> None:
    assert said_of(OWN + off_m * np.array([1.0, 0.0, 0.0, 0.0])) == ""
    assert said_of(OWN + off_m) == ""


@pytest.mark.parametrize(("apart_m", "named"), [(0.019, False), (0.021, True)])
def test_what_a_tape_leaves_is_not_named(apart_m: float, named: bool) -> None:
    close = OWN.copy()
    close[1] = close[0] + apart_m
    motion = Trajectory(np.arange(2.0), ("x",), np.zeros((2, 1)))
    run = SwingRun("a", "identify", motion, close[[1, 0, 2, 3]])
    assert bool(exchanged_sentence(run, ROBOT, close)) == named


@pytest.mark.parametrize(("left_m", "named"), [(0.019, True), (0.021, False)])
def test_so_much_may_be_left(left_m: float, named: bool) -> None:
    stated = OWN[[1, 0, 2, 3]].copy()
    stated[2] += left_m  # of 0.1
    assert bool(said_of(stated)) == named


@pytest.fixture
def exchanged(session: Path) -> Path:
    """The small session; its first run's lengths stand in the wrong places."""
    read = read_session(session)
    (swing, _) = load_swings(read, read_robot(read.robot), None)
    lengths = pose_lengths(swing, read_robot(read.robot))
    assert lengths is not None
    words = ", ".join(f"{value:.4f}" for value in lengths[[0, 3, 2, 1]])
    path = session / "session.toml"
    old = 'name = "swing-01"\n'
    text = path.read_text(encoding="utf-8").replace(old, f"{old}cable_lengths_m = [{words}]\n")
    path.write_text(text, encoding="utf-8")
    return session


@pytest.mark.parametrize("command", ["check", "identify", "diagnose"])
def test_commands_refuse_them(
    exchanged: Path, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, str(exchanged)]) == 1
    told = capsys.readouterr()
    names = [cable.name for cable in ROBOT.cables]
    assert f"lengths of cables {names[1]} and {names[3]} are exchanged" in told.out + told.err
    assert not (exchanged / "results" / "identification.json").exists()


@pytest.fixture(scope="module")
def free_alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The three-cable sample, three runs of it, of which x, y and chi alone were measured."""
    folder = tmp_path_factory.mktemp("free") / "session"
    shutil.copytree(SAMPLES / "three-cables", folder)
    path = folder / "session.toml"
    path.write_text("[[runs]]".join(path.read_text("utf-8").split("[[runs]]")[:4]), "utf-8")
    read = read_session(folder)
    robot = read_robot(read.robot)
    for run, swing in zip(read.runs, load_swings(read, robot, None), strict=True):
        assert run.trajectory is not None
        write_csv(run.trajectory, swing.trajectory.select(("x", "y", "chi")))
    return folder


def exchange(session: Path, order: tuple[int, ...], runs: int) -> None:
    """Puts the lengths of the first runs in other places."""

    def exchanged_line(match: re.Match[str]) -> str:
        words = match.group(1).split(", ")
        return f"cable_lengths_m = [{', '.join(words[k] for k in order)}]"

    path = session / "session.toml"
    pattern = r"cable_lengths_m = \[(.*?)\]"
    path.write_text(re.sub(pattern, exchanged_line, path.read_text("utf-8"), count=runs), "utf-8")


@pytest.mark.parametrize("command", ["check", "identify"])
def test_free_coordinates_alone_name_them_too(
    free_alone: Path, command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(free_alone, tmp_path / "session")
    exchange(tmp_path / "session", (1, 0, 2), 1)
    assert main([command, str(tmp_path / "session")]) == 1
    told = capsys.readouterr()
    said = "lengths of cables 1 and 2, up to 148 mm apart, are exchanged"
    assert f"run swing-01: cable_lengths_m: the {said}" in told.out + told.err
    assert "swing-02: cable_lengths_m" not in told.out + told.err


@pytest.mark.parametrize("order", [(0, 2, 1), (1, 0, 2), (2, 1, 0), (1, 2, 0)])
def test_every_run_where_lengths_stand_in_other_places(
    free_alone: Path, order: tuple[int, ...], tmp_path: Path
) -> None:
    shutil.copytree(free_alone, tmp_path / "session")
    exchange(tmp_path / "session", order, 3)
    read = read_session(tmp_path / "session")
    robot = read_robot(read.robot)
    swings = load_swings(read, robot, None)
    apart = [np.abs(np.subtract(s.lengths_m, s.lengths_m[list(order)])).max() for s in swings]  # pyright: ignore[reportArgumentType, reportCallIssue, reportOptionalSubscript]
    named = [bool(exchanged_at_rest(swing, robot)[1]) for swing in swings]
    assert named == [bool(one > 0.02) for one in apart]
    with pytest.raises(DataError, match="put each cable's length in its place"):
        refuse_exchanged_lengths(swings, robot)


def test_lengths_as_they_are_rest_where_they_were_measured(free_alone: Path) -> None:
    read = read_session(free_alone)
    robot = read_robot(read.robot)
    swings = load_swings(read, robot, None)
    refuse_exchanged_lengths(swings, robot)
    wrong = [replace(s, lengths_m=s.lengths_m + np.array([0.1, 0.0, 0.0])) for s in swings]
    refuse_exchanged_lengths(wrong, robot)  # merely wrong: another matter
    unknown = replace(robot, platform=replace(robot.platform, com_m=None))
    refuse_exchanged_lengths(swings, unknown)


@pytest.mark.parametrize("without", [(False, True), (True, False), (True, True), (False, False)])
def test_the_remedy_is_the_same_whichever_run_comes_first(without, monkeypatch) -> None:
    """Of runs without poses it may be the ends; where one run has none, that is said too."""
    names = [f"{k} {'free' if one else 'posed'}" for k, one in enumerate(without)]
    motion = Trajectory(np.arange(2.0), ("x",), np.zeros((2, 1)))
    runs = [SwingRun(name, "identify", motion, OWN[[1, 0, 2, 3]]) for name in names]
    monkeypatch.setattr(
        exchanged_lengths, "pose_lengths", lambda run, _: OWN if "posed" in run.name else None
    )
    monkeypatch.setattr(
        exchanged_lengths, "exchanged_at_rest", lambda *_: (None, "these are exchanged")
    )
    with pytest.raises(DataError) as told:
        refuse_exchanged_lengths(runs, ROBOT)
    assert "put each cable's length in its place" in str(told.value)
    said = str(told.value).count("or each cable's ends in robot.toml")
    assert said == any(without), str(told.value)


@pytest.mark.parametrize(("apart_m", "named"), [(0.0045, False), (0.0055, True)])
def test_two_wires_of_a_bench_in_each_others_place(apart_m: float, named: bool) -> None:
    """A plate on three wires, the first a little longer than the second, told the other way."""
    ring = np.array([[0.25, 0.0, 0.0], [-0.1, 0.2, 0.0], [-0.1, -0.2, 0.0]])
    longer = np.array([apart_m, 0.0, 0.0])
    cables = tuple(
        Cable(str(k + 1), end + np.array([0.0, 0.0, 1.2 + longer[k]]), 0.0, end)
        for k, end in enumerate(ring)
    )
    times = np.arange(200) / 50.0
    poses = np.zeros((200, 6))
    poses[:, 5] = 0.01 * np.sin(4.0 * times)
    signals = tuple(Signal(n, poses[:, k]) for k, n in enumerate(POSE_COORDINATES))
    told = 1.2 + longer[[1, 0, 2]]
    bench = Bench((BenchRun("a", "identify", times, signals, told, 1e-3),))
    robot = Robot("plate", cables)
    if named:
        with pytest.raises(DataError, match=r"lengths of cables 1 and 2 are exchanged"):
            refuse_wrong_bench_runs(bench, robot)
    else:
        refuse_wrong_bench_runs(bench, robot)
    assert BENCH_DIFFERENCE_M < 0.02
    refuse_wrong_bench_runs(replace(bench, runs=(replace(bench.runs[0], lengths_m=None),)), robot)


def test_a_benchs_recording_given_twice() -> None:
    """Yaw alone is compared too; channels alone are nobody's coordinates."""
    times = np.arange(200) / 50.0
    yaw = np.random.default_rng(1).normal(size=200)
    run = BenchRun("a", "identify", times, (Signal("chi", yaw),), np.full(4, 1.5))
    again = replace(run, name="b")
    with pytest.raises(DataError, match="runs a and b hold the same samples"):
        refuse_wrong_bench_runs(Bench((run, again)), ROBOT)
    dots = tuple(replace(one, signals=(Signal("dot_px", yaw),)) for one in (run, again))
    refuse_wrong_bench_runs(Bench(dots), ROBOT)


@pytest.mark.parametrize("columns", [("phi", "theta", "chi"), ("phi", "theta")])
@pytest.mark.parametrize(
    ("longer_mm", "told_mm", "named"),
    [
        ((20.0, 0.0, 0.0), (0.0, 20.0, 0.0), "cables 1 and 2"),
        ((20.0, 10.0, 0.0), (0.0, 20.0, 10.0), "cables 1 and 2 and 3"),
        ((20.0, 0.0, 0.0), (20.0, 0.0, 0.0), ""),
        ((20.0, 0.0, 0.0), (5.0, 0.0, 0.0), ""),
        ((4.6, 0.0, 0.0), (0.0, 4.6, 0.0), ""),
    ],
)
def test_wires_in_each_others_place_by_how_the_platform_leans(
    columns, longer_mm, told_mm, named
) -> None:
    """Neither x, y nor z measured: three heights make the plane that phi and theta see."""
    ring = np.array([[0.25, 0.0, 0.0], [-0.1, 0.2, 0.0], [-0.1, -0.2, 0.0]])
    up = np.array([0.0, 0.0, 1.2])
    cables = tuple(Cable(str(k + 1), end + up, 0.0, end) for k, end in enumerate(ring))
    along_x, along_y, _ = np.linalg.solve(
        np.column_stack([ring[:, :2], np.ones(3)]), -1e-3 * np.array(longer_mm)
    )
    lean = {"phi": along_y, "theta": -along_x, "chi": 0.0}
    times = np.arange(100) / 50.0
    signals = tuple(Signal(name, np.full(100, lean[name])) for name in columns)
    run = BenchRun("a", "identify", times, signals, 1.2 + 1e-3 * np.array(told_mm), 1e-3)
    robot = Robot("plate", cables, free_coordinates=("x", "y", "chi"))
    assert named in exchanged_by_lean(run, robot)
    assert bool(exchanged_by_lean(run, robot)) == bool(named)
    assert not leans_shown(run, replace(robot, free_coordinates=("phi", "theta", "chi")))
