"""What a sample's expected.toml and truth say, beside what the commands found."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.cdpr.robot import INERTIA_NAMES
from tests.places import SAMPLES


def expected(name: str) -> dict[str, Any]:
    return tomllib.loads((SAMPLES / name / "expected.toml").read_text(encoding="utf-8"))


def result(folder: Path, kind: str) -> dict[str, Any]:
    return json.loads((folder / f"{kind}.json").read_text(encoding="utf-8"))


def check_inertia(name: str, results: Path) -> None:
    """The estimate that the sample names lies where its truth, tolerance and intervals say."""
    wanted = expected(name)
    rows = result(results, "identification")["estimates"][wanted["estimate"]]["parameters"]
    error = _column(rows, "value") - _true_inertia(name)
    z = error / _column(rows, "std")
    tolerance = np.repeat([wanted["com_tolerance_m"], wanted["inertia_tolerance_m2"]], (3, 6))
    assert (np.abs(error) <= tolerance).all(), f"{name}: errors {error}, limits {tolerance}"
    assert np.abs(z).max() <= wanted["largest_z"], f"{name}: z {np.round(z, 1)}"


def check_diagnosis(name: str, results: Path) -> None:
    """Accepted effects, their rate, and how near the noise held-out runs are predicted."""
    wanted = expected(name)["diagnosis"]
    found = result(results, "diagnosis")
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


def _true_inertia(name: str) -> np.ndarray:
    truth = json.loads((SAMPLES / name / "truth" / "truth.json").read_text(encoding="utf-8"))
    return np.array([*truth["com_m"], *truth["specific_inertia_m2"]])


def _column(rows: list[dict[str, Any]], key: str) -> np.ndarray:
    by_name = {row["name"]: row[key] for row in rows}
    return np.array([by_name[name] for name in INERTIA_NAMES])
