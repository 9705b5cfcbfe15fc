"""A capture program that stalls repeats its last pose: what is identified stays right."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from freeswing.main import main
from tests.places import SAMPLES

SAMPLE = SAMPLES / "three-cables"


@pytest.mark.slow
def test_a_capture_that_repeats_its_last_pose_moves_no_centre_of_mass(tmp_path: Path) -> None:
    folder = tmp_path / "lab"
    shutil.copytree(SAMPLE, folder, ignore=shutil.ignore_patterns("truth", "results"))
    for number, path in enumerate(sorted((folder / "runs").glob("swing-0[1-5].csv"))):
        head, *rows = path.read_text(encoding="utf-8").splitlines()
        first = 150 + 90 * number
        pose = rows[first].split(",", 1)[1]
        rows[first : first + 30] = [f"{row.split(',')[0]},{pose}" for row in rows[first:][:30]]
        path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    main(["check", str(folder), "--quiet"])
    check = json.loads((folder / "results" / "check.json").read_text(encoding="utf-8"))
    said = [f["subject"] for f in check["findings"] if "the same sample stands" in f["text"]]
    assert said == [f"run swing-0{k}" for k in range(1, 6)], check["findings"]
    assert main(["identify", str(folder), "--quiet"]) == 0
    found = json.loads((folder / "results" / "identification.json").read_text(encoding="utf-8"))
    truth = json.loads((SAMPLE / "truth" / "truth.json").read_text(encoding="utf-8"))
    for name in ("ml_full", "fidim_full"):
        rows = {row["name"]: row for row in found["estimates"][name]["parameters"]}
        for axis, true in zip("xyz", truth["com_m"], strict=True):
            row = rows[f"com_{axis}_m"]
            z = (row["value"] - true) / row["std"]
            assert abs(z) < 3.0, f"{name} com_{axis}: {z:.2f} deviations of {row['std']:.2e} m"
