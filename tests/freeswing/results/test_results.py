"""Result documents: typed, read and written alike, and refused with the key that is wrong."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from freeswing.cdpr.files.documents import InputError, write_json
from freeswing.results.calibration import Calibration
from freeswing.results.diagnosis import Diagnosis
from freeswing.results.files import read_document
from freeswing.results.identification import Identification
from freeswing.results.planning import PlannedSwing
from tests.freeswing.report.report_material import whole_material


def test_what_is_read_is_written_again() -> None:
    for document in whole_material().documents.values():
        told = document.to_json()
        again = type(document).from_json(json.loads(json.dumps(told)))
        assert again == document
        assert list(again.to_json()) == list(told), "keys keep their order"


def test_unknown_keys_survive() -> None:
    table = {"format": "freeswing-diagnosis/1", "before": {"tomorrow": [1, {"a": None}]}, "new": 1}
    found = Diagnosis.from_json(table)
    told = found.to_json()
    assert told["new"] == 1
    assert told["before"]["tomorrow"] == [1, {"a": None}]


def test_absent_and_null_are_told_apart() -> None:
    pose = {"position_m": [0, 0, 0], "angles_rad": [0, 0, 0]}
    for more in ({}, {"winch_release": None}, {"winch_release": {"file": "a.csv"}}):
        table = {"equilibrium": pose, "release": pose, **more}
        told = PlannedSwing.from_json(table).to_json()
        assert ("winch_release" in told) == ("winch_release" in more), told
        assert told.get("winch_release") == more.get("winch_release")


@pytest.mark.parametrize(
    ("table", "where"),
    [
        (
            {"estimates": {"ml_full": {"parameters": [{"name": 3}]}}},
            r"ml_full\.parameters\[0\]\.name",
        ),
        ({"estimates": {"ml_full": {"parameters": [{}]}}}, r"parameters\[0\] lacks name"),
        ({"validation": {}}, "validation is '{}', not a list"),
        ({"amplification": True}, "amplification is 'True', not a number"),
        ({"swings": [{"run": "a", "equilibrium": 2}]}, r"swings\[0\]\.equilibrium"),
    ],
)
def test_a_wrong_value_is_named(table: dict, where: str) -> None:
    with pytest.raises(ValueError, match=where):
        Identification.from_json({"format": "freeswing-identification/1", **table})


def test_a_file_of_another_kind_or_version_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "calibration.json"
    assert read_document(path, Calibration) is None
    for told in ("freeswing-calibration/2", "freeswing-tracking/1", None):
        write_json(path, {"format": told})
        with pytest.raises(InputError, match=r"format is not freeswing-calibration/1.*delete it"):
            read_document(path, Calibration)
    path.write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match=r"calibration\.json"):
        read_document(path, Calibration)
