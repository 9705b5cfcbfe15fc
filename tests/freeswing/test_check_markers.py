"""Faults of marker recordings, through the command line: named in mm and by label."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.trajectory_files import read_recording, write_trc
from freeswing.cdpr.measured.target import Target, read_target, write_target
from freeswing.main import main
from freeswing.session.load_swings import load_robot, load_swings, load_target
from freeswing.session.session_file import read_session
from tests.places import SAMPLES

SAMPLE = SAMPLES / "mocap-trc"
RUNS = ("swing-01", "swing-02", "check-01")


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """Three runs of the motion-capture sample, three seconds each."""
    folder = tmp_path / "lab"
    (folder / "runs").mkdir(parents=True)
    for name in ("robot.toml", "target.toml"):
        shutil.copy(SAMPLE / name, folder)
    text = 'format = "freeswing-session/1"\nname = "lab"\nrobot = "robot.toml"\n'
    text += 'target = "target.toml"\nframe_rate_hz = 100.0\n'
    for name in RUNS:
        role = "validate" if name.startswith("check") else "identify"
        text += f'[[runs]]\nname = "{name}"\nrole = "{role}"\ntrajectory = "runs/{name}.trc"\n'
        whole = read_recording(SAMPLE / "runs" / f"{name}.trc")
        part = replace(whole, times_s=whole.times_s[:300], positions_m=whole.positions_m[:300])
        write_trc(folder / "runs" / f"{name}.trc", part)
    (folder / "session.toml").write_text(text, encoding="utf-8")
    return folder


def change(lab: Path, points=None, names=None, run: str = "swing-02") -> None:
    """Write a run again with other points or names."""
    path = lab / "runs" / f"{run}.trc"
    made = read_recording(path)
    moved = np.array(made.positions_m)
    if points is not None:
        points(moved)
    write_trc(path, replace(made, positions_m=moved, names=names or made.names))


def checked(lab: Path) -> tuple[int, list[str]]:
    status = main(["check", str(lab), "--quiet"])
    found = json.loads((lab / "results" / "check.json").read_text(encoding="utf-8"))["findings"]
    return status, [f"{f['level']} {f['subject']}: {f['text']}; {f['remedy']}" for f in found]


def positions(lab: Path, run: str = "swing-02") -> np.ndarray:
    session = read_session(lab)
    swings = load_swings(session, load_robot(session), load_target(session))
    return next(swing for swing in swings if swing.name == run).trajectory.positions()


def one(lines: list[str], words: str) -> str:
    found = [line for line in lines if words in line]
    assert len(found) == 1, (words, lines)
    return found[0]


def test_a_clean_session_has_rigidity_in_micrometres_and_no_warning_of_markers(lab: Path) -> None:
    status, lines = checked(lab)
    assert status == 0
    line = one(lines, "run swing-02: markers are rigid to P ")
    sizes = [float(word) for word in line.replace(",", "").split() if word.isdigit()]
    assert len(sizes) == 4
    assert np.abs(np.array(sizes) - 100.0).max() < 15.0, line
    assert not [x for x in lines if x.startswith("warning") and "marker" in x], lines


def test_labels_exchanged_for_ten_frames(lab: Path) -> None:
    before = positions(lab)

    def exchange(points: np.ndarray) -> None:
        points[100:110, [1, 2]] = points[100:110, [2, 1]]

    change(lab, exchange)
    line = one(checked(lab)[1], "are exchanged in 10 samples")
    assert line.startswith("warning run swing-02: labels left and front")
    assert np.nanmax(np.abs(positions(lab) - before)) < 1e-6


def test_labels_exchanged_throughout(lab: Path) -> None:
    before = positions(lab)
    change(lab, names=("P", "front", "left", "right"))
    line = one(checked(lab)[1], "labels are exchanged throughout")
    assert "left is labelled front, front is labelled left" in line
    assert np.nanmax(np.abs(positions(lab) - before)) < 1e-6


def test_a_marker_80_mm_off_for_five_frames(lab: Path) -> None:
    before = positions(lab)

    def away(points: np.ndarray) -> None:
        points[150:155, 3, 2] += 0.08

    change(lab, away)
    line = one(checked(lab)[1], "marker right jumps by up to")
    assert "in 5 samples from 1.50 s" in line
    assert np.nanmax(np.linalg.norm(positions(lab) - before, axis=1)) < 1e-3  # 0.1 mm of noise


def test_a_marker_20_mm_off_in_the_target(lab: Path) -> None:
    before = positions(lab)
    target = read_target(lab / "target.toml")
    first, left, *rest = target.markers
    moved = replace(left, position_m=left.position_m + np.array([0.0, 0.0, 0.02]))
    write_target(lab / "target.toml", Target((), (first, moved, *rest)))
    line = one(checked(lab)[1], "from where target.toml has it")
    assert line.startswith("warning target: marker left lies 20.0 mm"), line
    assert "position_m = [-0.1700" in line
    assert np.nanmax(np.abs(positions(lab) - before)) < 1e-4


def test_a_target_in_millimetres(lab: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = read_target(lab / "target.toml")
    wrong = [replace(m, position_m=1000.0 * m.position_m) for m in target.markers]
    write_target(lab / "target.toml", Target((), tuple(wrong)))
    assert main(["identify", str(lab), "--quiet"]) == 2
    said = capsys.readouterr().err
    assert "target.toml: position_m: its markers are 1000 times as far apart" in said
    assert "metres" in said


def test_a_marker_that_drifts_is_left_out_of_its_run_and_named(lab: Path) -> None:
    before = positions(lab)

    def drift(points: np.ndarray) -> None:
        points[:, 2, 0] += 1e-3 * np.sin(np.arange(300) / 40.0)

    change(lab, drift)
    line = one(checked(lab)[1], "marker front is not rigid with the others")
    assert line.startswith("warning run swing-02"), line
    off = np.nanmax(np.linalg.norm(positions(lab) - before, axis=1))
    assert off < 1e-3, off


def test_labels_in_capitals_and_with_a_subject(lab: Path) -> None:
    before = positions(lab)
    change(lab, names=("Rig:P", "Rig:LEFT", "Rig:Front", "Rig:right"))
    assert np.nanmax(np.abs(positions(lab) - before)) < 1e-9
