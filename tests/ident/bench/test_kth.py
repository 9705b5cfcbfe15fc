"""A real trifilar bench, a laser dot on a wall: KTH Stockholm 2014 (shared/real/kth-trifilar)."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from freeswing.main import main
from tests.places import REAL, needs_real

pytestmark = [pytest.mark.slow, needs_real("kth-trifilar")]
PUBLISHED, PUBLISHED_STD = 0.23479, 0.00035  # by period and formula; not the truth
MASS_KG = 0.02094


def told(folder: Path, session: str) -> dict:
    shutil.copytree(REAL / "kth-trifilar", folder / "kth")
    path = folder / "kth" / session
    assert main(["identify", str(path), "--results", str(folder / "out"), "--quiet"]) == 0
    return json.loads((folder / "out" / "identification.json").read_text(encoding="utf-8"))


def rows_of(document: dict) -> dict[str, dict[str, dict]]:
    return {
        one["name"]: {row["name"]: row for row in one["parameters"]} for one in document["objects"]
    }


def test_the_platform_and_what_the_recordings_contradict(tmp_path: Path) -> None:
    document = told(tmp_path, "session.toml")
    izz = rows_of(document)["platform"]["Izz_P_kg_m2"]
    off = abs(izz["value"] - PUBLISHED) / (izz["std"] ** 2 + PUBLISHED_STD**2) ** 0.5
    assert off < 2.2, izz
    assert izz["std"] < 0.045 * izz["value"], izz
    assert document["scatter_between_runs_kg_m2"] < 2.5e-4, document["scatter_between_runs_kg_m2"]
    notes = " ".join(document["notes"])
    assert "the sway contradicts cable_lengths_m" in notes, notes
    assert "has not converged" not in notes, notes


def test_positions_as_unknown_loads(tmp_path: Path) -> None:
    """Every second position of the nuts: m r^2 within 2 deviations in four of five."""
    bodies = rows_of(told(tmp_path, "session-loads.toml"))
    within = 0
    for name, rows in bodies.items():
        if name != "platform":
            expected = MASS_KG * float(name.removeprefix("nuts-")) ** 2
            row = rows["Izz_P_kg_m2"]
            within += abs(row["value"] - expected) < 2.0 * row["std"]
    assert within >= 4, bodies


def test_what_is_off_is_told_with_what_it_cannot_be(tmp_path: Path) -> None:
    """Wires by sway; some per cent that are neither wires nor clock; no more than that."""
    shutil.copytree(REAL / "kth-trifilar", tmp_path / "kth")
    assert main(["diagnose", str(tmp_path / "kth"), "--results", str(tmp_path / "out")]) == 0
    told = json.loads((tmp_path / "out" / "diagnosis.json").read_text(encoding="utf-8"))
    (wires,) = told["accepted"]
    assert (wires["effect"], wires["part"]) == ("cable_length_bias", "all wires"), wires
    assert -0.0115 < wires["parameters"][0]["value"] < -0.0075, wires
    assert "frame_rate" in wires["confounded_with"], wires
    rows = {row["effect"]: row for row in told["candidates"]}
    assert {"wire_radii", "payload_distance", "centre_of_mass"} <= set(
        rows["platform_mass"]["confounded_with"]
    )
    assert not {"frame_rate", "wire_length"} & set(rows["platform_mass"]["confounded_with"])
    assert rows["gravity_tilt"]["verdict"] == "not_identifiable", rows["gravity_tilt"]
