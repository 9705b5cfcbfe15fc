"""Recordings in another frame than the base: hinted at by check, and turned by [mocap]."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.trajectory_files import read_recording, write_trc
from freeswing.main import main
from tests.freeswing.test_check_markers import checked, lab, positions

__all__ = ["lab"]

Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # recorded = Y_UP @ base


def move(folder: Path, R: np.ndarray, t: np.ndarray) -> None:
    for path in (folder / "runs").glob("*.trc"):
        made = read_recording(path)
        write_trc(path, replace(made, positions_m=made.positions_m @ R.T + t))


def say(folder: Path, section: str) -> None:
    path = folder / "session.toml"
    path.write_text(path.read_text(encoding="utf-8") + section, encoding="utf-8")


def test_y_up_is_hinted_at_and_turned(lab: Path) -> None:
    before = positions(lab)
    move(lab, Y_UP, np.zeros(3))
    told = "its axis y points up: cable lengths are off by"
    lines = [line for line in checked(lab)[1] if told in line]
    assert len(lines) == 3, lines
    assert '[mocap] up = "y"' in lines[0]
    say(lab, '\n[mocap]\nup = "y"\n')
    assert np.nanmax(np.abs(positions(lab) - before)) < 1e-9
    assert not [line for line in checked(lab)[1] if "points up" in line]


def test_a_frame_of_its_own_is_aligned_by_three_points(lab: Path) -> None:
    before = positions(lab)
    t = np.array([3.0, 1.0, -2.0])
    move(lab, Y_UP, t)
    base = np.array([[0.0, 0, 0], [2.0, 0.1, 0], [0.3, 1.5, 0.2], [1.0, 1.0, 1.0]])
    points = "".join(
        f"[[mocap.reference]]\nrecorded_m = {(Y_UP @ p + t).tolist()}\nbase_m = {p.tolist()}\n"
        for p in base
    )
    text = (lab / "session.toml").read_text(encoding="utf-8")
    say(lab, points)
    assert np.nanmax(np.abs(positions(lab) - before)) < 1e-9
    wrong = points.replace("recorded_m = [3.0, 1.0, -2.0]", "recorded_m = [3.1, 1.0, -2.0]")
    assert wrong != points
    (lab / "session.toml").write_text(text + wrong, encoding="utf-8")
    assert main(["check", str(lab), "--quiet"]) == 2


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ('up = "w"', "must be one of x, y, z"),
        ("", "give one of them"),
        ("[[mocap.reference]]\nrecorded_m = [0, 0, 0]\nbase_m = [0, 0, 0]", "three or more"),
    ],
)
def test_a_section_that_says_nothing_is_named(lab: Path, capsys, section, message) -> None:
    say(lab, f"\n[mocap]\n{section}\n")
    assert main(["check", str(lab), "--quiet"]) == 2
    assert message in capsys.readouterr().err
