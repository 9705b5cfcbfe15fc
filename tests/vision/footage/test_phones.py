"""Two phones from video files to a centre of mass, without one stamp beside them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from freeswing.main import main
from tests.vision.footage.phones import Phone, write_session

PHONES = {
    "left": Phone(0.1, line_time_s=25e-6, dropped=0.03, jitter_s=2e-4),
    "right": Phone(3.3, line_time_s=-18e-6, turn_deg=180, dropped=0.05, jitter_s=2e-4),
}


@pytest.fixture(scope="module")
def phones(tmp_path_factory) -> tuple[Path, dict, object]:
    """Started by hand, tracked: the folder, tracking.json and the true body."""
    folder = tmp_path_factory.mktemp("phones")
    body = write_session(folder, PHONES, 6.0)
    assert main(["track", str(folder), "--quiet"]) == 0
    return folder, json.loads((folder / "results" / "tracking.json").read_text()), body


def effects(tracking: dict, effect: str, camera: str) -> list[float]:
    return [
        found["parameters"][0]["value"]
        for found in tracking["effects"]
        if (found["effect"], found["camera"]) == (effect, camera)
    ]


@pytest.mark.slow
def test_two_phones_started_by_hand_are_placed_in_time(phones) -> None:
    _, tracking, _ = phones
    late = effects(tracking, "clock_offset", "right")
    assert len(late) == len(tracking["runs"])
    assert all(abs(offset - 3.2) < 4e-3 for offset in late), late
    for camera, phone in PHONES.items():
        lines = effects(tracking, "rolling_shutter", camera)
        assert len(lines) == len(tracking["runs"]), camera
        assert all(abs(line - phone.line_time_s) < 4e-6 for line in lines), (camera, lines)
    for run in tracking["runs"]:
        assert any("recorded by one camera alone" in text for text in run["problems"]), run


@pytest.mark.slow
def test_two_phones_started_by_hand_give_the_centre_of_mass(phones) -> None:
    """H.264 makes tags look 0.003 px larger, and lengths are told with errors of 0.3 mm."""
    folder, _, body = phones
    assert main(["identify", str(folder), "--quiet"]) == 0
    found = json.loads((folder / "results" / "identification.json").read_text())
    assert set(found["estimates"]) == {"ml_full", "ml_free", "fidim_full", "fidim_free"}
    for name, estimate in found["estimates"].items():
        told = {p["name"]: p for p in estimate["parameters"]}
        for axis, true in zip("xyz", body.com_m, strict=True):
            entry = told[f"com_{axis}_m"]
            z = (entry["value"] - true) / entry["std"]
            assert abs(z) < 3.0, f"{name} com_{axis}: {z:.2f} of {1e3 * entry['std']:.4f} mm"
    best = found["estimates"]["ml_full"]
    told = {p["name"]: p["std"] for p in best["parameters"]}
    # What poses of squeezed film leave looks like a robot file that is wrong: that share is apart.
    own = told["com_y_m"] ** 2 - (best.get("geometry_std") or [0.0] * 9)[1] ** 2
    assert own < (3e-5) ** 2, "deviations that hold anything"
    assert told["com_y_m"] < 2e-4, "a geometry that holds anything"


@pytest.mark.slow
def test_two_phones_tags_are_freed_of_what_squeezing_adds(phones) -> None:
    _, tracking, _ = phones
    for run in tracking["runs"]:
        assert any("larger to each side" in text for text in run["problems"]), run["problems"]
