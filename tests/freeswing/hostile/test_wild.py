"""Wild samples in a held-out recording, through the command line."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from freeswing.main import main
from tests.places import SAMPLES


def spoilt(path: Path, rows: slice, off_m: float) -> None:
    """Moves some samples of a recording along x."""
    head, *lines = path.read_text(encoding="utf-8").splitlines()
    column = head.split(",").index("x_m")
    cells = [line.split(",") for line in lines]
    for row in cells[rows]:
        row[column] = repr(float(row[column]) + off_m)
    path.write_text("\n".join([head, *map(",".join, cells), ""]), encoding="utf-8")


@pytest.mark.slow
def test_a_held_out_error_is_the_motions(tmp_path: Path, capsys) -> None:
    """Ten samples 80 mm off are left out by name; one of 2 mm is named with what it does."""
    session = shutil.copytree(SAMPLES / "three-cables", tmp_path / "session")
    spoilt(session / "runs" / "swing-06.csv", slice(300, 310), 0.08)
    spoilt(session / "runs" / "swing-07.csv", slice(200, 201), 0.002)
    assert main(["check", str(session)]) == 0
    assert "the samples from 3.00 to 3.09 s are" in capsys.readouterr().out
    assert main(["identify", str(session)]) == 0
    told = capsys.readouterr().out
    assert "run swing-06: the samples from 3.00 to 3.09 s are" in told
    assert "run swing-07: 1 of 401 samples (2.00 s) lie up to 2" in told
    found = json.loads((session / "results" / "identification.json").read_text())
    errors = [run["prediction_rmse_m"] for run in found["validation"]]
    np.testing.assert_allclose(errors, [1.0e-4, 1.15e-4], atol=1e-5)
