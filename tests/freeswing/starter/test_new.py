"""A stranger's walk: from recordings and an empty folder to a report."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.measured.target import read_target
from freeswing.main import main
from freeswing.starter.kinds import KINDS
from tests.places import SAMPLES

SAMPLE = SAMPLES / "mocap-trc"
RECORDINGS = sorted((SAMPLE / "runs").glob("*.trc"))
MOST_COMMANDS = 6


def begin(folder: Path) -> None:
    files = [str(path) for path in RECORDINGS]
    assert main(["new", str(folder), "--mass-kg", "8", "--mocap", *files]) == 0


def turn_to_new_frame(folder: Path) -> np.ndarray:
    """Rotation from the sample's platform frame to the new one, by two of its markers' arms."""
    bases = []
    for path in (SAMPLE / "target.toml", folder / "target.toml"):
        place = {m.name: m.position_m for m in read_target(path).markers}
        arm, other = (place[name] - place["P"] for name in ("left", "front"))
        x = arm / np.linalg.norm(arm)
        z = np.cross(arm, other) / np.linalg.norm(np.cross(arm, other))
        bases.append(np.stack([x, np.cross(z, x), z], axis=1))
    return bases[1] @ bases[0].T


def measure(folder: Path) -> None:
    """What a person measures goes where robot.toml says nan."""
    turn = turn_to_new_frame(folder)
    text = (folder / "robot.toml").read_text(encoding="utf-8")
    head, *tables = text.split("[[cables]]")
    filled = [head]
    for table, cable in zip(tables, read_robot(SAMPLE / "robot.toml").cables, strict=True):
        vectors = {
            "entry_m": cable.entry_m,
            "attachment_m": turn @ cable.attachment_m,
            "swivel_x": cable.swivel_x,
            "swivel_y": cable.swivel_y,
            "swivel_z": cable.swivel_z,
        }
        for key, value in vectors.items():
            table = re.sub(rf"(?m)^{key} = \[.*?\]", f"{key} = {value.tolist()}", table)
        filled.append(
            table.replace("pulley_radius_m = nan", f"pulley_radius_m = {cable.pulley_radius_m}")
        )
    (folder / "robot.toml").write_text("[[cables]]".join(filled), encoding="utf-8")


def test_recordings_are_read_and_missing_numbers_are_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "lab-day"
    begin(folder)
    told = capsys.readouterr().out
    assert f"{len(RECORDINGS)} recordings of P, left, front, right at 100 Hz" in told, told
    # 0.1 mm of noise a marker and coordinate, less what four markers' fitted pose takes up.
    assert re.search(r"keep their distances to 0\.0[5-9] mm", told), told
    assert main(["check", str(folder)]) == 1, "nothing runs before the nan are gone"
    assert "cables[1].entry_m[0]: nan is not a finite number" in capsys.readouterr().out
    measure(folder)
    assert main(["check", str(folder)]) == 0, capsys.readouterr().err
    session = (folder / "session.toml").read_text(encoding="utf-8")
    assert session.count('role = "validate"') == len(RECORDINGS) // 3
    assert (folder / "runs" / RECORDINGS[0].name).read_bytes() == RECORDINGS[0].read_bytes()


def test_the_markers_keep_their_distances(tmp_path: Path) -> None:
    """The sample's noise is 0.1 mm a marker and sample: the mean of hundreds is far sharper."""
    folder = tmp_path / "lab-day"
    begin(folder)
    sides = []
    for path in (SAMPLE / "target.toml", folder / "target.toml"):
        place = {m.name: m.position_m for m in read_target(path).markers}
        names = ("P", "left", "front", "right")
        sides.append([np.linalg.norm(place[a] - place[b]) for a in names for b in names])
    np.testing.assert_allclose(sides[1], sides[0], atol=1e-3)


def test_nothing_is_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "lab-day"
    assert main(["new", str(folder), "--kind", "trifilar"]) == 0
    before = (folder / "robot.toml").read_bytes()
    assert main(["new", str(folder), "--kind", "hook"]) == 2
    assert "already there" in capsys.readouterr().err
    assert (folder / "robot.toml").read_bytes() == before


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_kind_reads_once_it_is_measured(kind: str, tmp_path: Path) -> None:
    folder = tmp_path / kind
    assert main(["new", str(folder), "--kind", kind]) == 0
    text = (folder / "robot.toml").read_text(encoding="utf-8")
    vectors = iter(np.random.default_rng(0).uniform(0.1, 1.0, (40, 3)).round(3).tolist())
    axes = {"swivel_x": "[1, 0, 0]", "swivel_y": "[0, 1, 0]", "swivel_z": "[0, 0, 1]"}
    for key, value in axes.items():
        text = re.sub(rf"(?m)^{key} = \[.*?\]", f"{key} = {value}", text)
    text = re.sub(r"\[nan, nan, nan\]", lambda _: str(next(vectors)), text)
    (folder / "robot.toml").write_text(text.replace("= nan", "= 0.02"), encoding="utf-8")
    robot = read_robot(folder / "robot.toml")
    assert robot.n_cables == KINDS[kind].cables
    assert len(robot.free_coordinates or ()) in (0, 6 - robot.n_cables)


@pytest.mark.slow
def test_the_walk_ends_with_a_trustworthy_answer(tmp_path: Path) -> None:
    """new, (measure), check, run: three commands; com and inertia are the sample's truth."""
    folder = tmp_path / "lab-day"
    begin(folder)
    measure(folder)
    commands = [["check", str(folder)], ["run", str(folder), "--workers", "1"]]
    assert len(commands) + 1 <= MOST_COMMANDS
    for command in commands:
        assert main(command) == 0, command
    assert "What hangs there" in (folder / "results" / "report.html").read_text(encoding="utf-8")
    found = json.loads((folder / "results" / "identification.json").read_text(encoding="utf-8"))
    rows = {row["name"]: row for row in found["estimates"]["ml_full"]["parameters"]}
    com = np.array([rows[f"com_{axis}_m"]["value"] for axis in "xyz"])
    told = json.loads((SAMPLE / "truth" / "truth.json").read_text(encoding="utf-8"))["com_m"]
    # The sample leaves 0.02 mm of the centre of mass; the frame's turn is known to about 0.1 mrad.
    assert np.abs(turn_to_new_frame(folder).T @ com - told).max() < 3e-4, (com, told)
