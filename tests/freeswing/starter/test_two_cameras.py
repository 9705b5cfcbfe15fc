"""A stranger's walk with two cameras: from an empty folder to a report that can be trusted."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.robot import INERTIA_NAMES
from freeswing.main import main
from tests.freeswing.starter.plate_films import fill_in, film_everything, plate

MOST_COMMANDS = 6
LARGEST_Z = 4.0  # of nine parameters; the samples allow 4.5


@pytest.mark.slow
def test_from_an_empty_folder_to_an_answer(tmp_path: Path) -> None:
    """new, (print, measure, film), check, run."""
    folder = tmp_path / "lab-day"
    words = ["--kind", "plate", "--cables", "3", "--mass-kg", "4", "--rate-hz", "20"]
    commands = [["new", str(folder), *words], ["check", str(folder)], ["run", str(folder)]]
    assert len(commands) <= MOST_COMMANDS
    assert main(commands[0]) == 0
    fill_in(folder, plate().robot)
    film_everything(folder)
    assert main(commands[1]) == 0
    assert main([*commands[2], "--workers", "2"]) == 0
    page = (folder / "results" / "report.html").read_text(encoding="utf-8")
    assert "Mass 4 kg, as stated in robot.toml." in page
    found = json.loads((folder / "results" / "identification.json").read_text(encoding="utf-8"))
    rows = {row["name"]: row for row in found["estimates"]["ml_full"]["parameters"]}
    values, std = (np.array([rows[n][key] for n in INERTIA_NAMES]) for key in ("value", "std"))
    off = values - plate().inertia
    assert np.abs(off[:3]).max() < 5e-4, f"centre of mass off by {1e3 * off[:3]} mm"
    assert np.abs(off / std).max() < LARGEST_Z, off / std
    diagnosis = json.loads((folder / "results" / "diagnosis.json").read_text(encoding="utf-8"))
    assert diagnosis["accepted"] == [], "nothing undeclared was there"
