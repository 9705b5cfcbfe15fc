"""`freeswing calibrate` from recordings to files, and beside COLMAP's own adjustment."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest

from freeswing.calib.camera.cameras_file import read_cameras
from freeswing.main import main
from tests.places import SAMPLES

pytest.importorskip("pycolmap")


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory):
    """samples/filmed calibrated with the check."""
    folder = tmp_path_factory.mktemp("calibrated")
    for name in ("robot.toml", "session.toml", "target.toml"):
        shutil.copy(SAMPLES / "filmed" / name, folder)
    shutil.copytree(SAMPLES / "filmed" / "calibration", folder / "calibration")
    assert main(["calibrate", str(folder), "--check-with", "pycolmap", "--quiet"]) == 0
    return folder


def test_colmap_agrees_and_the_result_says_so(calibrated) -> None:
    """Figures as `beside_colmap` gives them; the truth says that both may agree."""
    told = json.loads((calibrated / "results" / "calibration.json").read_text(encoding="utf-8"))
    beside = told["beside_colmap"]
    assert [one["camera"] for one in beside] == ["left", "right"], beside
    for one in beside:
        assert one["agrees"], one
        assert abs(one["focal"]) < 3.0 * one["focal_std"], one
        assert one["place_mm"] < 3.0, one
    assert told["provenance"]["settings"]["check_with"] == "pycolmap", told["provenance"]


def test_cameras_are_those_of_the_truth(calibrated) -> None:
    found = read_cameras(calibrated / "cameras.toml")
    truth = read_cameras(SAMPLES / "filmed" / "truth" / "cameras.toml")
    for one, other in zip(found, truth, strict=True):
        off = np.linalg.norm(one.position_base_m - other.position_base_m)
        assert off < 5e-3, f"{one.name}: {1e3 * off:.2f} mm"
