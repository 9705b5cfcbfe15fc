"""The driven sample through the command line: looked over, estimated, diagnosed, shown, exported.

Its motions come from the paper's equations in tests/oracle, by tests/samples/make_driven.py.
"""

import json
from pathlib import Path

import pytest

from freeswing.main import main
from tests.places import SAMPLES

INCA = SAMPLES / "inca-6d"
TRUTH = json.loads((INCA / "truth" / "truth.json").read_text())


def results(command: str, folder: Path, *flags: str) -> None:
    assert main([command, str(INCA), "--results", str(folder), "--quiet", *flags]) == 0


def test_the_driven_sample_is_found_in_order(tmp_path):
    results("check", tmp_path)
    assert json.loads((tmp_path / "check.json").read_text())["findings"] == []


@pytest.mark.slow
def test_the_driven_sample_is_estimated_diagnosed_and_shown(tmp_path, capsys):
    results("run", tmp_path)
    assert "something is missing in the model" in capsys.readouterr().err
    found = json.loads((tmp_path / "diagnosis.json").read_text())
    effect = TRUTH["effects"][0]
    assert [(one["effect"], one["part"]) for one in found["accepted"]] == [
        (effect["effect"], effect["part"])
    ]
    number = found["accepted"][0]["parameters"][0]
    gap = abs(number["value"] - effect["added"])
    assert gap < max(4.0 * number["std"], 0.05 * effect["added"]), number
    assert not found["unexplained"]["present"]
    assert found["accepted"][0]["evidence"][0]["run"] == "val_b"
    page = (tmp_path / "report.html").read_text()
    for text in ("Table 2", "Fig. 7", "Friction from ramps", "Where each accepted effect is seen"):
        assert text in page, text
    # Without the effect inertia is not determined: no model is made of that.
    assert main(["export", str(INCA), "--mjcf", "--results", str(tmp_path)]) == 1
    assert "has no value of Ixx_kg_m2" in capsys.readouterr().err
    assert not (INCA / "results").exists(), "the sample's folder was written to"


@pytest.mark.slow
def test_the_driven_sample_comes_back_with_its_effect(tmp_path):
    """Every number within four deviations, from Table 1's initial robot."""
    results("drive", tmp_path, "--effect", "coulomb_friction.5")
    document = json.loads((tmp_path / "drive.json").read_text())
    truth = TRUTH["parameters"] | {"coulomb_friction.added_5_N_m": TRUTH["effects"][0]["added"]}
    for entry in document["estimates"]["joint"]["parameters"]:
        error = entry["value"] - truth[entry["name"]]
        assert abs(error) < 4.0 * entry["std"], entry
        assert entry["std"] < 5e-3 * abs(entry["value"]), entry
    assert max(document["residual"]["times_noise"].values()) < 1.5
    for ramp in document["ramps"]:
        # Two samples of 2 ms at 1 A/s, as torque.
        gap = abs(ramp["ramp_N_m"] - ramp["estimate_on_this_ramp_N_m"])
        assert gap < 2.5e-4 * 1.5, ramp
    friction = {ramp["motor"]: ramp["estimate_N_m"] for ramp in document["ramps"]}
    assert friction["5"] - friction["1"] == pytest.approx(2.4e-3, rel=0.01)
    results("export", tmp_path, "--mjcf")
    assert (tmp_path / "robot.xml").stat().st_size > 1000
