"""Python's front: the commands' own results, as a notebook shows them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import freeswing as fs
from freeswing.front.found import identified
from freeswing.results.diagnosis import Diagnosis
from freeswing.results.identification import Identification
from freeswing.session.stages import IDENTIFY
from tests.freeswing.report.report_material import HOSTILE, whole_material
from tests.freeswing.session.test_freshness import leave, rows
from tests.places import SAMPLES


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


def test_pictures_of_every_kind(solved: Path) -> None:
    found = fs.open(solved).identify()
    with pytest.raises(ValueError, match="not one of intervals, residuals"):
        found.plot("pie")
    with pytest.raises(ValueError, match="keeps no correlations"):
        found.plot("correlation")
    with pytest.raises(ValueError, match="holds no motions"):
        found.plot("residuals")
    known = whole()
    assert len(known.plot("residuals").axes) == 3 * 6
    assert len(known.plot("spectra").axes) == 3 * 6
    assert "1.00" not in {t.get_text() for t in known.plot("correlation").axes[0].texts}


def whole() -> fs.Found:
    material = whole_material()
    assert material.identification is not None
    return identified(material.identification, material.fitted)


def test_pandas_takes_it() -> None:
    pandas = pytest.importorskip("pandas")
    frame = whole().to_dataframe()
    assert isinstance(frame, pandas.DataFrame)
    assert frame.loc["com_z_m", "std"] > 0.0


def test_arviz_draws_follow_values_and_correlations() -> None:
    pytest.importorskip("arviz")
    found = whole()
    posterior = found.to_arviz(draws=20_000)["posterior"]
    x, z = (posterior[name].values.ravel() for name in ("com_x_m", "com_z_m"))
    assert x.mean() == pytest.approx(found.value("com_x_m"), abs=4 * x.std() / 141)
    # 20 000 draws tell a correlation to 0.007.
    assert np.corrcoef(x, z)[0, 1] == pytest.approx(found.correlation[0][2], abs=0.03)


def test_without_pandas_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    monkeypatch.setitem(sys.modules, "arviz", None)
    with pytest.raises(ImportError, match="pip install pandas"):
        whole().to_dataframe()
    with pytest.raises(ImportError, match="pip install arviz"):
        whole().to_arviz()


def test_a_robot_hangs_and_swings() -> None:
    robot = fs.Robot.from_toml(SAMPLES / "two-cables" / "robot.toml")
    rest, modes = robot.equilibrium([1.1, 1.1])
    swing = robot.simulate([1.1, 1.1], amplitude_m=1e-3, duration_s=4.0)
    assert isinstance(swing, fs.Trajectory)
    assert len(swing) == 401
    assert np.abs(swing.positions() - rest.zeta[:3]).max() < 3e-3
    assert (modes.frequencies_hz > 0.1).all()
    drag = {"translational_drag": {"rate_1_s": 1.0}}
    slowed = robot.simulate([1.1, 1.1], amplitude_m=1e-3, duration_s=4.0, effects=drag)
    assert np.ptp(slowed.values[-100:, :3]) < np.ptp(swing.values[-100:, :3])
    with pytest.raises(fs.InputError, match="3 lengths, the robot has 2 cables"):
        robot.equilibrium([1.0, 1.0, 1.0])
    with pytest.raises(fs.InputError, match="parameter rate: not one of rate_1_s"):
        robot.simulate([1.1, 1.1], effects={"translational_drag": {"rate": 1.0}})


def test_recorded_swings_come_as_trajectories(session: Path) -> None:
    lab = fs.open(session)
    assert len(lab.swing("swing-01")) == 601
    assert lab.robot().n_cables == 4
    assert "check-01" in lab._repr_html_()
    with pytest.raises(KeyError, match="swing-09: not among swing-01, check-01"):
        lab.swing("swing-09")


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
