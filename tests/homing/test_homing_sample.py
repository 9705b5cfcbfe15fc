"""The homing sample through the command line."""

import json

import numpy as np

from freeswing.main import main
from tests.places import SAMPLES

SAMPLE = SAMPLES / "homing"


def test_the_sample_is_homed_within_its_own_standard_deviations(tmp_path):
    status = main(["home", str(SAMPLE), "--results", str(tmp_path), "--quiet"])
    found = json.loads((tmp_path / "homing.json").read_text())
    truth = json.loads((SAMPLE / "truth" / "truth.json").read_text())
    assert status == 0
    for key in ("position_m", "angles_rad"):
        error = np.subtract(found["start_pose"][key], truth["start_pose"][key])
        sizes = np.abs(error) / found["start_pose_std"][key]
        assert (sizes < 5).all(), f"{key}: off by {sizes} standard deviations"


def test_a_simulated_acquisition_is_homed(tmp_path, capsys):
    made = tmp_path / "made"
    assert main(["home", str(SAMPLE / "robot.toml"), "--simulate", str(made)]) == 0
    assert main(["home", str(made / "homing.toml")]) == 0
    assert "position" in capsys.readouterr().out


def test_a_wrong_column_ends_with_2(tmp_path, capsys):
    for name in ("robot.toml", "homing.toml"):
        (tmp_path / name).write_bytes((SAMPLE / name).read_bytes())
    (tmp_path / "readings.csv").write_text("a,b\n0,0\n")
    assert main(["home", str(tmp_path)]) == 2
    assert "column" in capsys.readouterr().err
