"""Tables with semicolons and decimal commas through the commands: the same results."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np

from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.main import main
from tests.places import SAMPLES


def with_semicolons(path: Path) -> None:
    """Writes a table again as spreadsheets of half of Europe do."""
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace(",", ";").replace(".", ","), encoding="utf-8")


def test_readings_of_homing(tmp_path: Path) -> None:
    found = []
    for name in ("plain", "semicolons"):
        folder = tmp_path / name
        shutil.copytree(SAMPLES / "homing", folder)
        if name == "semicolons":
            with_semicolons(folder / "readings.csv")
        assert main(["home", str(folder), "--quiet"]) == 0
        found.append(json.loads((folder / "results" / "homing.json").read_text(encoding="utf-8")))
    assert found[0]["start_pose"] == found[1]["start_pose"]
    assert found[0]["start_pose_std"] == found[1]["start_pose_std"]


def test_trajectories(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    lines = (SAMPLES / "three-cables" / "runs" / "swing-01.csv").read_text().splitlines()[:200]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert main(["convert", str(path), str(tmp_path / "plain.csv")]) == 0
    with_semicolons(path)
    assert main(["convert", str(path), str(tmp_path / "semicolons.csv")]) == 0
    plain, other = (read_trajectory(tmp_path / f"{n}.csv") for n in ("plain", "semicolons"))
    assert np.array_equal(plain.values, other.values)
    assert np.array_equal(plain.times_s, other.times_s)
