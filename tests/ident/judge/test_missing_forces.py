"""Forces that a model lacks widen the inertia's deviations by what residuals say they are."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.ident.estimate import Estimate
from freeswing.ident.fidim.ends_share import missing_share
from freeswing.ident.fitted import Fitted, with_missing
from freeswing.ident.judge import wrong_geometry as room
from freeswing.ident.judge.asked_errors import Asked
from freeswing.ident.judge.missing_forces import (
    MissingForces,
    together,
    unreliable,
    with_missing_forces,
)
from freeswing.ident.judge.wrong_geometry import WrongGeometry
from freeswing.main import main
from tests.ident.swings import TRUE_INERTIA, paper_model
from tests.oracle.recorded.sessions import make_session

TILT, DRAG = np.zeros((9, 2)), np.zeros((9, 1))
TILT[0, 0] = TILT[1, 1] = 1e-2
DRAG[5] = 1e-4
KNOWN = {"gravity_tilt": TILT, "rotational_drag": DRAG}


def estimate() -> Estimate:
    return Estimate(TRUE_INERTIA, np.diag(np.full(9, 1e-10)), np.ones(9, bool), 1000)


def test_deviations_hold_what_forces_of_that_size_do() -> None:
    missing = MissingForces({"gravity_tilt": 0.3}, KNOWN)
    told = with_missing_forces(estimate(), missing, missing.sizes)
    wanted = np.full(9, 1e-5)
    wanted[:2] = np.hypot(1e-5, 3e-3)
    assert told.std == pytest.approx(wanted)
    assert told.extra["forces_std"] == pytest.approx([3e-3, 3e-3, *[0.0] * 7])
    assert "gravity_tilt (the base frame is not level)" in told.notes[0]
    assert "up to 300.0 times" in told.notes[0]
    assert (told.values == TRUE_INERTIA).all()


def test_where_residuals_ask_for_none_nothing_changes() -> None:
    exact = estimate()
    assert with_missing_forces(exact, MissingForces({}, KNOWN), {}) is exact
    assert with_missing_forces(exact, MissingForces(), {"gravity_tilt": 1.0}) is exact


def test_what_poses_show_counts_for_free_coordinates_too() -> None:
    full = MissingForces({"gravity_tilt": 0.3, "rotational_drag": 0.1}, KNOWN)
    free = MissingForces({"rotational_drag": 0.2}, KNOWN)
    sizes = together([full, free])
    assert sizes == {"gravity_tilt": 0.3, "rotational_drag": 0.2}
    assert free.changes(sizes).shape == (3, 9)


@pytest.mark.parametrize(("colour", "relied_on"), [(1.8, True), (2.1, False)])
def test_what_nothing_follows_is_not_relied_on(monkeypatch, colour, relied_on) -> None:
    """Sixty numbers of one colour, of which a tilt follows none: a bob on a string left 5."""
    generator = np.random.default_rng(7)
    answers, moved = np.zeros((60, 38)), generator.standard_normal((9, 38))
    seen = np.sqrt(colour) * np.ones(60)
    causes = {"geometry": np.arange(36), "gravity_tilt": np.arange(36, 38)}
    asked = Asked(answers, seen, moved, causes, 10.0)
    monkeypatch.setattr(room, "asked_errors", lambda _: asked)
    monkeypatch.setattr(room, "_stated", lambda _: {})
    found: Any = SimpleNamespace(model=None, noise=np.full(2, 1e-4))
    wrong, missing = room.doubts(found)
    assert (unreliable(missing) == "") == relied_on
    assert (wrong.size, missing.sizes) == (0.0, {})


@pytest.mark.parametrize(("colour", "asks"), [(1.8, False), (8.0, True)])
def test_more_than_twice_white_noise_is_of_the_model(monkeypatch, colour, asks) -> None:
    """What cameras may leave asks for nothing; what is far from white has to be followed."""
    generator = np.random.default_rng(8)
    answers, moved = 300.0 * generator.standard_normal((60, 38)), np.ones((9, 38))
    causes = {"geometry": np.arange(36), "gravity_tilt": np.arange(36, 38)}
    seen = np.sqrt(colour) * generator.standard_normal(60)
    asked = Asked(answers, seen, moved, causes, colour)
    monkeypatch.setattr(room, "asked_errors", lambda _: asked)
    monkeypatch.setattr(room, "_stated", lambda _: {})
    found: Any = SimpleNamespace(model=None, noise=np.full(2, 1e-4))
    wrong, missing = room.doubts(found)
    assert (wrong.size > 0.0 or bool(missing.sizes)) == asks


def test_geometry_that_poses_show_counts_for_free_coordinates_too() -> None:
    full = WrongGeometry(4.0, 16.0 * np.eye(9), {}, np.eye(9))
    free = WrongGeometry(0.0, np.zeros((9, 9)), {}, 1e-8 * np.eye(9))
    fits = {
        name: Fitted(estimate(), paper_model().robot, (), wrong)
        for name, wrong in {"ml_full": full, "ml_free": free}.items()
    }
    told = with_missing(fits)
    assert told["ml_full"].estimate.extra["geometry_std"] == pytest.approx([4.0] * 9)
    assert told["ml_free"].estimate.extra["geometry_std"] == pytest.approx([4e-4] * 9)
    exact = with_missing({"ml_free": fits["ml_free"]})["ml_free"]
    assert exact.estimate.std == pytest.approx(estimate().std)


def test_fidim_counts_the_same() -> None:
    kept = np.array([True, *[True] * 3, *[False] * 6])
    stack: Any = SimpleNamespace(kept=kept)
    share = missing_share(
        MissingForces({"gravity_tilt": 0.3}, KNOWN).changes({"gravity_tilt": 0.3}), stack
    )
    assert share.document() == {"forces_std": pytest.approx([3e-3, 3e-3, *[0.0] * 7])}
    assert np.sqrt(np.diag(share.reduced)) == pytest.approx([3e-3, 3e-3, 0.0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "effects"),
    [
        ("three-cable", {"gravity_tilt": "small", "quadratic_drag": "medium"}),
        ("three-cable", {"torsion_spring": "medium"}),
        ("bologna-4", {"constant_force": "medium"}),
        ("three-cable", {"marker_offset": "medium"}),
        ("bologna-4", {"hanging_bob": "medium"}),
    ],
)
def test_no_number_beside_a_missing_force_is_wrong_and_sure(
    tmp_path: Path, robot: str, effects: dict[str, str]
) -> None:
    """Through the command, on full poses of the independent integrator."""
    truth = make_session(tmp_path, 78, robot, effects, n_runs=7, duration_s=6.0)
    told = identified(tmp_path)
    for name, one in told.items():
        z = deviations(one, truth.body)
        assert np.abs(z).max() < 3.5, f"{name}: {np.round(z, 1)}"
    best = told["ml_full"]
    own = [row["std"] for row in best["parameters"][:9]]
    share = np.square(best["forces_std"]) + np.square(best.get("geometry_std") or np.zeros(9))
    bare = deviations(best, truth.body) * own / np.sqrt(np.square(own) - share)
    assert np.abs(bare).max() > 3.5, f"without it: {np.round(bare, 1)}"


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["bologna-4", "three-cable"])
def test_where_nothing_is_missing_claims_stay(tmp_path: Path, robot: str) -> None:
    make_session(tmp_path, 79, robot, n_runs=7, duration_s=6.0)
    for name, one in identified(tmp_path).items():
        assert "forces_std" not in one, name
        assert "geometry_std" not in one, name


def identified(folder: Path) -> dict[str, Any]:
    assert main(["identify", str(folder)]) == 0
    return json.loads((folder / "results" / "identification.json").read_text())["estimates"]


def deviations(told: dict[str, Any], body: Any) -> np.ndarray:
    true = np.concatenate([body.com_m, body.specific_inertia_m2])
    rows = told["parameters"][:9]
    pairs = zip(rows, true, strict=True)
    return np.array([(row["value"] - at) / row["std"] for row, at in pairs])
