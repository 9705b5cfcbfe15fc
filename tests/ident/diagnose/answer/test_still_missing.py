"""What an answer leaves in the residuals widens all that is told beside it."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.effects import catalogue
from freeswing.cdpr.model.equations import build_model
from freeswing.ident.diagnose.answer import still_missing as room
from freeswing.ident.diagnose.answer.still_missing import still_missing
from freeswing.ident.judge.asked_errors import GEOMETRY, Asked
from freeswing.main import main
from tests.ident.swings import paper_model
from tests.oracle.recorded.sessions import make_session

UNKNOWNS = 10  # the inertia's nine, and one value of an effect that was found
COLOUR = 4.0


def fit(noise_m: float = 1e-4) -> SimpleNamespace:
    model = build_model(paper_model().robot)
    covariance = COLOUR * np.eye(UNKNOWNS)
    return SimpleNamespace(
        noise=np.full(2, noise_m), model=model, covariance=covariance, samples=()
    )


def answered(monkeypatch, seen: np.ndarray, of_geometry: float = 1.0) -> None:
    """Sixty numbers of which the last ten are the geometry's, and the last but these a tilt's."""
    answers = np.zeros((60, 11))
    answers[50:, :10] = of_geometry * np.eye(10)
    answers[49, 10] = 1.0
    moved = np.zeros((UNKNOWNS, 11))
    moved[0, :10], moved[9, 10] = 0.1, 0.2
    causes = {GEOMETRY: np.arange(10), "gravity_tilt": np.array([10])}
    asked = Asked(answers, seen, moved, causes, COLOUR)
    monkeypatch.setattr(room, "asked_errors", lambda *_: asked)


def rest(power: float) -> np.ndarray:
    return np.sqrt(power) * np.random.default_rng(3).choice([-1.0, 1.0], 60)


def test_a_rest_that_others_were_refused_for_is_as_large_as_it_is(monkeypatch) -> None:
    """Geometry and a tilt would have been asked for as much as the rest is: 70 tolerances."""
    answered(monkeypatch, rest(100.0))
    found = still_missing(fit(), refused=True, by_lengths=False)
    assert (found.sizes, found.left) == ({}, pytest.approx(100.0, rel=0.2))
    wider = found.widened(np.diag([400.0, *np.full(9, 4.0)]))
    assert np.diag(wider) == pytest.approx([400.0 + found.left, *[4.0 + found.left] * 9])
    assert found.note(wider) == ""
    assert "100 times as strong as white noise" in found.reliance(wider)


def test_where_nothing_was_found_it_is_of_what_is_known(monkeypatch) -> None:
    answered(monkeypatch, rest(100.0))
    found = still_missing(fit(), refused=False, by_lengths=False)
    assert set(found.sizes) == {GEOMETRY, "gravity_tilt"}
    assert found.left == pytest.approx(2.0)
    told = COLOUR * np.eye(UNKNOWNS)
    wider = np.diag(found.widened(told))
    size = found.sizes[GEOMETRY]
    assert wider[0] == pytest.approx(COLOUR + 10.0 * (0.1 * size) ** 2)
    tilt = 0.2 * found.sizes["gravity_tilt"]
    assert wider[9] == pytest.approx(COLOUR + tilt**2), "a value that was found"
    named = found.note(told)
    assert f"off by {size:.2g} times their tolerances" in named
    assert f"up to {np.sqrt(wider[0] / COLOUR):.1f} times" in named
    assert found.reliance(told).startswith("do not rely on these values")


@pytest.mark.parametrize(("asked", "size"), [(0.5, 0.5), (3.0, 1.0)])
def test_geometry_beside_lengths_is_as_good_as_its_tolerances(monkeypatch, asked, size) -> None:
    """A bob on a string asked for 75 of them, which lengths do not have."""
    seen = np.append(np.ones(50), 100.0 * asked * np.ones(10))
    answered(monkeypatch, seen, of_geometry=100.0)
    found = still_missing(fit(), refused=False, by_lengths=True)
    assert found.sizes[GEOMETRY] == pytest.approx(size, rel=0.05)


def test_elsewhere_geometry_is_grossly_off_at_most(monkeypatch) -> None:
    answered(monkeypatch, np.append(np.ones(50), 4000.0 * np.ones(10)), of_geometry=100.0)
    found = still_missing(fit(), refused=False, by_lengths=False)
    assert found.sizes[GEOMETRY] == pytest.approx(12.0, rel=0.05)


def test_what_is_asked_for_at_the_noise_is_said_too(monkeypatch) -> None:
    """A clock 0.3 % fast was followed to 1.02 of the noise, with cables of some mass."""
    answered(monkeypatch, np.append(np.ones(50), 300.0 * np.ones(10)), of_geometry=100.0)
    found = still_missing(fit(), refused=False, by_lengths=False)
    told = COLOUR * np.eye(UNKNOWNS)
    assert found.left < 2.0
    assert found.reliance(told) == found.note(told) != ""


ALL = tuple(catalogue())


@pytest.mark.parametrize(
    ("without", "held"),
    [("", True), ("tether", False), ("pulley_friction", False), ("cable_length_bias", True)],
)
def test_what_was_not_looked_for_was_not_refused(monkeypatch, without: str, held: bool) -> None:
    """Of drag alone a rest was told that "no force or geometry that is known here follows it".

    Without lengths these cannot be biased.
    """
    answered(monkeypatch, rest(100.0))
    names = [name for name in ALL if name != without]
    found = still_missing(fit(), refused=True, by_lengths=False, candidates=names)
    assert found.refused == held == bool(found.random.any())
    assert (set(found.sizes) == set()) == held


@pytest.mark.parametrize(("without", "size"), [("", 1.0), ("tether", 1.0), ("anchor_offset", 3.0)])
def test_geometry_that_lengths_were_not_asked_of_is_not_settled(
    monkeypatch, without: str, size: float
) -> None:
    """An anchor beside `--only gravity_tilt` was held to be off by a tolerance at most."""
    answered(monkeypatch, np.append(np.ones(50), 300.0 * np.ones(10)), of_geometry=100.0)
    names = [name for name in ALL if name != without]
    found = still_missing(fit(), refused=False, by_lengths=True, candidates=names)
    assert found.sizes[GEOMETRY] == pytest.approx(size, rel=0.05)


@pytest.mark.parametrize("refused", [False, True])
def test_noise_widens_nothing_and_says_nothing(monkeypatch, refused: bool) -> None:
    answered(monkeypatch, rest(1.0))
    found = still_missing(fit(), refused, by_lengths=True)
    told = np.diag(np.full(UNKNOWNS, COLOUR))
    np.testing.assert_array_equal(found.widened(told), told)
    assert found.note(told) == found.reliance(told) == ""
    assert not still_missing(fit(1e-8), refused, True).sizes


def test_what_runs_leave_open_stays_so(monkeypatch) -> None:
    answered(monkeypatch, rest(100.0))
    known = fit()
    known.covariance[0, 0] = np.inf
    found = still_missing(known, refused=True, by_lengths=False)
    wider = np.diag(found.widened(known.covariance))
    assert wider == pytest.approx([np.inf, *[COLOUR] * 9])


@pytest.mark.parametrize(("power", "adds"), [(1.9, False), (2.1, True)])
def test_what_measurement_may_leave_is_no_rest(monkeypatch, power: float, adds: bool) -> None:
    answered(monkeypatch, rest(power), of_geometry=1e-6)
    monkeypatch.setattr(room, "_most_left", lambda *_: power)
    found = still_missing(fit(), refused=True, by_lengths=False)
    assert bool(found.random.any()) == adds == bool(found.reliance(np.eye(UNKNOWNS)))


@pytest.mark.parametrize("kind", [ValueError, np.linalg.LinAlgError])
def test_a_question_that_fails_is_said(monkeypatch, kind) -> None:
    def fails(*_: object) -> None:
        raise kind("did not converge")

    monkeypatch.setattr(room, "asked_errors", fails)
    found = still_missing(fit(), refused=True, by_lengths=True)
    assert np.diag(found.widened(np.eye(UNKNOWNS))) == pytest.approx(np.ones(UNKNOWNS))
    assert "(did not converge)" in found.note(np.eye(UNKNOWNS))


@pytest.mark.slow
@pytest.mark.parametrize("size", ["medium", "large"])
def test_no_inertia_beside_a_bob_is_wrong_and_sure(tmp_path: Path, size: str) -> None:
    """It was up to 33 deviations off."""
    truth = make_session(tmp_path, 31, "three-cable", {"hanging_bob": size})
    assert main(["diagnose", str(tmp_path)]) == 0
    told = json.loads((tmp_path / "results" / "diagnosis.json").read_text())
    true = [*truth.body.com_m, *truth.body.specific_inertia_m2]
    z = [(p["value"] - v) / p["std"] for p, v in zip(told["parameters_after"], true, strict=True)]
    assert np.abs(z).max() < 4.0, np.round(z, 1)
    assert told["unexplained"]["reliance"].startswith("do not rely on these values")
