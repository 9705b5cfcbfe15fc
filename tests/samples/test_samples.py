"""Every measured sample through the command line: what its expected.toml says, against its truth.

The sample that was filmed has a file of its own, test_filmed.py.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from freeswing.main import main
from tests.samples.expectations import SAMPLES, check_diagnosis, check_inertia, result

NAMES = ("mocap-trc", "three-cables", "two-cables", "undeclared-drag")
QUICK = "two-cables"


def test_all_samples_are_tested() -> None:
    found = {path.parent.name for path in SAMPLES.glob("*/expected.toml")}
    assert found == {*NAMES, "filmed"}


@pytest.mark.parametrize("name", NAMES)
def test_a_sample_is_found_in_order(name: str, tmp_path: Path) -> None:
    assert main(["check", str(SAMPLES / name), "--results", str(tmp_path), "--quiet"]) == 0
    findings = result(tmp_path, "check")["findings"]
    assert [one for one in findings if one["level"] != "note"] == []


@pytest.mark.parametrize(
    "name",
    [name if name == QUICK else pytest.param(name, marks=pytest.mark.slow) for name in NAMES],
)
def test_a_sample_is_identified(name: str, tmp_path: Path) -> None:
    assert main(["identify", str(SAMPLES / name), "--results", str(tmp_path), "--quiet"]) == 0
    check_inertia(name, tmp_path)
    assert not list((SAMPLES / name).glob("results")), "the sample's folder was written to"


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_sample_is_diagnosed(name: str, tmp_path: Path) -> None:
    assert main(["run", str(SAMPLES / name), "--results", str(tmp_path), "--quiet"]) == 0
    check_diagnosis(name, tmp_path)
    assert (tmp_path / "report.html").stat().st_size > 50_000
