"""The bench samples through the command line: the object beside its truth."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from freeswing.main import main
from tests.places import SAMPLES
from tests.samples.expectations import result


@pytest.mark.slow
@pytest.mark.parametrize(("seen", "share"), [("poses", 0.01), ("track", 0.04)])
def test_the_object_of_a_bench_sample(seen: str, share: float, tmp_path: Path) -> None:
    """Six runs of six seconds: half of what the ten runs of ten seconds are asked for."""
    folder = SAMPLES / "trifilar" / seen
    assert main(["identify", str(folder), "--results", str(tmp_path), "--quiet"]) == 0
    truth = json.loads((folder / "truth" / "truth.json").read_text(encoding="utf-8"))
    told = result(tmp_path, "identification")
    rows = {one["name"]: {row["name"]: row for row in one["parameters"]} for one in told["objects"]}
    found, wanted = rows["object"]["Izz_kg_m2"], truth["object_Izz_kg_m2"]
    assert abs(found["value"] / wanted - 1.0) < share, found
    assert abs(found["value"] - wanted) < 3.0 * found["std"], found
    platform = rows["platform"]["Izz_P_kg_m2"]
    assert abs(platform["value"] - truth["platform_Izz_P_kg_m2"]) < 3.0 * platform["std"], platform
    assert told["budgets"][0]["shares"], "no error budget"
    for channel in told.get("channels", []):
        # tests/oracle/recorded/benches.py: 1100 tan(2 chi + 0.3) pixels, told by no calibration.
        gain, slope = channel["gains"][0], 2200.0 / np.cos(0.3) ** 2
        assert gain["std"] < 0.15 * slope, gain
        assert abs(gain["value"] - slope) < 3.0 * gain["std"], gain
