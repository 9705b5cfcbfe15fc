"""Every sample through the command line: what its expected.toml says, against its sealed truth."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdpr.robot import INERTIA_NAMES
from freeswing.main import main

SAMPLES = Path(__file__).parents[2] / "samples"
NAMES = sorted(path.parent.name for path in SAMPLES.glob("*/expected.toml"))


def expected(name: str) -> dict[str, Any]:
    return tomllib.loads((SAMPLES / name / "expected.toml").read_text(encoding="utf-8"))


def true_inertia(name: str) -> np.ndarray:
    truth = json.loads((SAMPLES / name / "truth" / "truth.json").read_text(encoding="utf-8"))
    return np.array([*truth["com_m"], *truth["specific_inertia_m2"]])


def result(folder: Path, kind: str) -> dict[str, Any]:
    return json.loads((folder / f"{kind}.json").read_text(encoding="utf-8"))


def column(rows: list[dict[str, Any]], key: str) -> np.ndarray:
    by_name = {row["name"]: row[key] for row in rows}
    return np.array([by_name[name] for name in INERTIA_NAMES])


def test_there_are_samples() -> None:
    assert {"mocap-trc", "two-cables", "three-cables", "undeclared-drag"} <= set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_a_sample_is_found_in_order(name: str, tmp_path: Path) -> None:
    assert main(["check", str(SAMPLES / name), "--results", str(tmp_path), "--quiet"]) == 0
    assert result(tmp_path, "check")["findings"] == []


@pytest.mark.parametrize("name", NAMES)
def test_a_sample_is_identified(name: str, tmp_path: Path) -> None:
    wanted = expected(name)
    assert main(["identify", str(SAMPLES / name), "--results", str(tmp_path), "--quiet"]) == 0
    rows = result(tmp_path, "identification")["estimates"][wanted["estimate"]]["parameters"]
    error = column(rows, "value") - true_inertia(name)
    z = error / column(rows, "std")
    tolerance = np.repeat([wanted["com_tolerance_m"], wanted["inertia_tolerance_m2"]], (3, 6))
    assert (np.abs(error) <= tolerance).all(), f"{name}: errors {error}, limits {tolerance}"
    assert np.abs(z).max() <= wanted["largest_z"], f"{name}: z {np.round(z, 1)}"
    assert not list((SAMPLES / name).glob("results")), "the sample's folder was written to"


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_sample_is_diagnosed(name: str, tmp_path: Path) -> None:
    wanted = expected(name)["diagnosis"]
    assert main(["run", str(SAMPLES / name), "--results", str(tmp_path), "--quiet"]) == 0
    found = result(tmp_path, "diagnosis")
    accepted = {entry["effect"]: entry for entry in found["accepted"]}
    assert list(accepted) == wanted["accepted"], f"{name}: {list(accepted)}"
    for effect, entry in accepted.items():
        rate = {row["name"]: row["value"] for row in entry["parameters"]}["rate_1_s"]
        off = abs(rate - wanted["rate_1_s"])
        assert off <= wanted["rate_tolerance_1_s"], f"{name}: {effect} rate {rate} 1/s"
    after = found["after"]
    ratio = after["prediction_rmse_m"] / after["noise_floor_m"]
    limit = wanted.get("largest_error_over_noise", 1.2)
    assert ratio <= limit, f"{name}: {ratio:.2f} times the noise"
    assert (tmp_path / "report.html").stat().st_size > 50_000
