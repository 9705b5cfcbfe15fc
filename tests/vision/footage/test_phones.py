"""Two phones from video files to a centre of mass, without one stamp beside them."""

from __future__ import annotations

import json

import pytest

from freeswing.main import main
from tests.vision.footage.phones import Phone, write_session

PHONES = {
    "left": Phone(0.1, line_time_s=25e-6, dropped=0.03, jitter_s=2e-4),
    "right": Phone(3.3, line_time_s=-18e-6, turn_deg=180, dropped=0.05, jitter_s=2e-4),
}


@pytest.mark.slow
@pytest.mark.xfail(reason="com y is 3.3 of its deviations off")
def test_two_phones_started_by_hand_give_the_centre_of_mass(tmp_path) -> None:
    body = write_session(tmp_path, PHONES, 6.0)
    for command in ("track", "identify"):
        assert main([command, str(tmp_path), "--quiet"]) == 0, command
    tracking = json.loads((tmp_path / "results" / "tracking.json").read_text())
    late = [
        effect["parameters"][0]["value"]
        for effect in tracking["effects"]
        if (effect["effect"], effect["camera"]) == ("clock_offset", "right")
    ]
    assert len(late) == len(tracking["runs"])
    assert all(abs(offset - 3.2) < 4e-3 for offset in late), late
    found = json.loads((tmp_path / "results" / "identification.json").read_text())
    told = {p["name"]: p for p in found["estimates"]["ml_full"]["parameters"]}
    for axis, true in zip("xyz", body.com_m, strict=True):
        entry = told[f"com_{axis}_m"]
        z = (entry["value"] - true) / entry["std"]
        assert abs(z) < 3.0, f"com_{axis}: {z:.2f} deviations ({1e3 * entry['std']:.4f} mm)"
