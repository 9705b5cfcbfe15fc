"""The sample that cameras recorded: calibrated, tracked, identified, each against its truth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from freeswing.calib.camera.cameras_file import read_cameras
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.main import main
from tests.samples.expectations import SAMPLES, check_diagnosis, check_inertia, expected, result

FILMED = SAMPLES / "filmed"
RUNS = ("swing-01", "swing-02", "swing-03", "check-01")
MOST_BYTES = 3_000_000


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results folder after check, calibrate beside COLMAP, track and identify."""
    folder = tmp_path_factory.mktemp("filmed")
    more = {"calibrate": ["--check-with", "pycolmap"], "track": ["--workers", "1"]}
    for command in ("check", "calibrate", "track", "identify"):
        words = [command, str(FILMED), "--results", str(folder), "--quiet", *more.get(command, [])]
        assert main(words) == 0, command
    return folder


@pytest.mark.slow
def test_it_is_small_and_left_alone(results: Path) -> None:
    files = [path for path in FILMED.rglob("*") if path.is_file()]
    size = sum(path.stat().st_size for path in files)
    assert size < MOST_BYTES, f"{size} bytes"
    assert not (FILMED / "results").exists()
    assert not (FILMED / "cameras.toml").exists()


def test_nothing_keeps_it_from_a_result(results: Path) -> None:
    worse = [f for f in result(results, "check")["findings"] if f["level"] != "note"]
    assert worse == []


def test_cameras_are_where_they_were(results: Path) -> None:
    wanted = expected("filmed")["calibration"]
    found = {camera.name: camera for camera in read_cameras(results / "cameras.toml")}
    truth = read_cameras(FILMED / "truth" / "cameras.toml")
    assert sorted(found) == sorted(camera.name for camera in truth)
    for camera in truth:
        off_m = np.linalg.norm(found[camera.name].position_base_m - camera.position_base_m)
        late_s = abs(found[camera.name].clock_offset_s - camera.clock_offset_s)
        assert off_m < wanted["position_tolerance_m"], f"{camera.name}: {1e3 * off_m:.2f} mm"
        assert late_s < wanted["clock_tolerance_s"], f"{camera.name}: {1e3 * late_s:.2f} ms"


def test_colmap_adjusts_the_same_corners_to_the_same_cameras(results: Path) -> None:
    told = result(results, "calibration")
    assert told["provenance"]["settings"]["check_with"] == "pycolmap", told["provenance"]
    beside = told["beside_colmap"]
    assert [one["camera"] for one in beside] == ["left", "right"], beside
    for one in beside:
        assert one["agrees"], one
        assert abs(one["focal"]) < 3.0 * one["focal_std"], one
        assert one["place_mm"] < 3.0, one
    assert not any("COLMAP" in text for text in told["verdict"]["warnings"]), told["verdict"]


@pytest.mark.parametrize("run", RUNS)
def test_the_platform_is_followed(results: Path, run: str) -> None:
    wanted = expected("filmed")["tracking"]
    found = read_trajectory(results / "tracks" / f"{run}.csv")
    truth = read_trajectory(FILMED / "truth" / f"{run}.csv")
    errors = found.values - CubicSpline(truth.times_s, truth.values)(found.times_s)
    rms = np.sqrt(np.mean(errors**2, axis=0))  # NaN, and so no pass, where a pose is missing
    assert len(found) >= 99, f"{len(found)} of 100 frames"
    assert rms[:3].max() < wanted["rms_tolerance_m"], f"{1e3 * rms[:3]} mm"
    assert rms[3:].max() < wanted["rms_tolerance_rad"], f"{1e3 * rms[3:]} mrad"


def test_the_inertia_comes_out(results: Path) -> None:
    check_inertia("filmed", results)


@pytest.mark.slow
def test_nothing_is_accepted_that_was_not_there(results: Path) -> None:
    assert main(["run", str(FILMED), "--results", str(results), "--quiet"]) == 0
    check_diagnosis("filmed", results)
    assert (results / "report.html").stat().st_size > 50_000
