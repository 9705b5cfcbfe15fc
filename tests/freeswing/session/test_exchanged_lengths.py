"""Cable lengths stated for one another's cables: named before anything is fitted to them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.ident.runs import SwingRun
from freeswing.main import main
from freeswing.session.exchanged_lengths import exchanged_sentence, pose_lengths
from freeswing.session.load_swings import load_swings
from freeswing.session.session_file import read_session
from tests.oracle.robots import declared_robot

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
