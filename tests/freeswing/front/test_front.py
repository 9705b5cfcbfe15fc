"""Python's front: the commands' own results, as a notebook shows them."""

from __future__ import annotations

from pathlib import Path

import pytest

import freeswing as fs
from freeswing.results.diagnosis import Diagnosis
from freeswing.results.identification import Identification
from freeswing.session.stages import IDENTIFY
from tests.freeswing.report.report_material import HOSTILE
from tests.freeswing.session.test_freshness import leave, rows


@pytest.fixture
def solved(session: Path) -> Path:
    estimates = {"ml_full": {"parameters": rows(1.0)}, "fidim_free": {"parameters": rows(1.1)}}
    leave(session, IDENTIFY, {"estimates": estimates, "notes": [HOSTILE]})
    return session


def test_what_is_up_to_date_is_not_made_again(solved: Path) -> None:
    lab = fs.open(solved)
    assert lab.runs == ("swing-01", "check-01")
    before = (solved / "results" / "identification.json").stat().st_mtime_ns
    found = lab.identify()
    assert (solved / "results" / "identification.json").stat().st_mtime_ns == before
    assert isinstance(found.document, Identification)
    assert found.value("com_z_m") == 0.19
    with pytest.raises(KeyError, match="mass_kg: not among com_x_m"):
        found.value("mass_kg")


def test_a_notebook_shows_a_table(solved: Path) -> None:
    found = fs.open(solved).identify()
    assert "com z         190.000 ± 0.020      mm" in repr(found), repr(found)
    html = found._repr_html_()
    assert "<td>190.000</td><td>0.020</td><td>mm</td>" in html
    assert "<script>" not in html
    assert len(found.plot().axes) == 9
    assert found.rows()[2] == {"name": "com_z_m", "value": 0.19, "std": 1e-5}


def test_a_diagnosis_says_its_verdict() -> None:
    from freeswing.front.found import diagnosed

    table = {"accepted": [{"effect": "translational_drag"}], "parameters_after": rows(1.0)}
    found = diagnosed(Diagnosis.from_json({"format": "freeswing-diagnosis/1", **table}))
    assert "The model lacked: translational drag." in str(found)
    assert len(found.plot().axes) == 9


def test_the_names_are_there_and_no_others() -> None:
    from freeswing import front

    assert all(getattr(fs, name) is getattr(front, name) for name in front.__all__)
    with pytest.raises(AttributeError, match="no attribute 'inertia'"):
        fs.inertia  # noqa: B018  pyright: ignore
