"""Inertias that no body has: told, and held to the nearest that one has, by both methods."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize

from freeswing.cdpr.files.documents import dump_toml
from freeswing.cdpr.files.robot_file import write_robot
from freeswing.cdpr.files.trajectory_csv import write_csv
from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.ident.estimate import Estimate
from freeswing.ident.identify import IdentifySettings, identify
from freeswing.ident.judge.physical_consistency import (
    LEAST_EXTENT_M,
    Consistency,
    consistency,
    is_possible,
    least_moment,
    nearest_possible,
    pseudo_inertia,
)
from freeswing.ident.likelihood.payload_runs import point_inertia
from freeswing.ident.runs import SwingRun
from freeswing.main import main
from tests.ident.swings import TRUE_INERTIA, paper_model, recorded, swing

EQUILIBRIA = (5, 7, 9, 11)


def body(points: Array) -> Array:
    """Specific inertia of equal point masses (n, 3), (9,)."""
    return np.mean([point_inertia(point) for point in points], axis=0)


def thin_plate() -> Array:
    """2 mm thick, about the true centre of mass: noise easily makes it thinner than nothing."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return body(TRUE_INERTIA[:3] + corners * [0.11, 0.16, 0.002])


def thin_swings(coordinates: tuple[str, ...], seed: int) -> list[SwingRun]:
    generator = np.random.default_rng(seed)
    motions = [swing(k, duration_s=5.0, inertia=tuple(thin_plate())) for k in EQUILIBRIA]
    return [
        recorded(motion, f"swing-{k}", generator, 3e-4, coordinates)
        for k, motion in zip(EQUILIBRIA, motions, strict=True)
    ]


def test_pseudo_inertia_is_the_mean_of_its_points():
    points = np.random.default_rng(0).normal(size=(20, 3))
    ends = np.column_stack([points, np.ones(20)])
    gap = np.abs(pseudo_inertia(body(points)) - ends.T @ ends / 20).max()
    assert gap < 1e-12, f"off by {gap}"
    least = np.linalg.eigvalsh(np.cov(points.T, bias=True))[0]
    assert least_moment(body(points))[0] == pytest.approx(least), f"{least}"


def test_slope_of_the_least_moment_is_that_of_differences():
    steps = 1e-6 * np.eye(9)
    slopes = [
        (least_moment(TRUE_INERTIA + s)[0] - least_moment(TRUE_INERTIA - s)[0]) / 2e-6
        for s in steps
    ]
    gap = np.abs(slopes - least_moment(TRUE_INERTIA)[1]).max()
    assert gap < 1e-6, f"off by {gap}"


def test_nearest_is_what_a_general_solver_finds():
    """SLSQP on the same distance with the constraint stated by eigenvalues."""
    target = TRUE_INERTIA + np.array([0.0, 0.0, 0.06, 0, 0, 0, 0, 0, 0])
    std = np.maximum(0.02 * np.abs(TRUE_INERTIA), 1e-4)
    found = nearest_possible(target, np.diag(std**2))
    limit = {
        "type": "ineq",
        "fun": lambda z: 1e3 * (least_moment(target + std * z)[0] - LEAST_EXTENT_M**2),
    }
    other = minimize(lambda z: z @ z, 1.3 * (found - target) / std, constraints=[limit])
    distance = float(np.sum(((found - target) / std) ** 2))
    assert distance == pytest.approx(other.fun, rel=1e-5), f"{distance} against {other.fun}"
    assert is_possible(found), f"{found}"


def test_nearest_is_no_farther_from_any_body_than_the_target():
    generator = np.random.default_rng(1)
    for _ in range(5):
        root = 1e-2 * generator.normal(size=(9, 9))
        target = TRUE_INERTIA + 0.05 * generator.standard_normal(9)
        found = nearest_possible(target, root @ root.T)
        was, now = (
            float(np.linalg.norm(np.linalg.solve(root, one - TRUE_INERTIA)))
            for one in (target, found)
        )
        assert now <= was * (1 + 1e-9), f"{now} from the truth, {was} before"


def test_what_is_possible_stays():
    found = nearest_possible(TRUE_INERTIA, np.diag(TRUE_INERTIA**2))
    assert (found == TRUE_INERTIA).all(), f"moved by {found - TRUE_INERTIA}"
    said = consistency(TRUE_INERTIA, np.diag((0.01 * TRUE_INERTIA) ** 2)).sentence()
    assert said == "", said


@pytest.mark.parametrize(("deviations", "refuted"), [(2.9, False), (3.1, True)])
def test_only_what_samples_exclude_is_called_wrong(deviations: float, refuted: bool) -> None:
    """A slightly conical trifilar tells Izz, and of all else next to nothing."""
    found = Consistency(-1e-3 * deviations, 1e-3)
    assert found.is_refuted == refuted
    assert ("one within its deviations can" in found.sentence()) != refuted
    assert ("look for what the model misses" in found.sentence()) == refuted


Pair = tuple[Estimate, Estimate]


@pytest.fixture(scope="module")
def likely() -> Pair:
    """Maximum likelihood by x and y, free and held."""
    runs = thin_swings(("x", "y"), seed=8)
    free, held = (_identified(runs, IdentifySettings(consistent=one)) for one in (False, True))
    return free["ml_free"], held["ml_free"]


@pytest.fixture(scope="module")
def published() -> Pair:
    """FIDIM by free coordinates, free and held."""
    runs = thin_swings(POSE_COORDINATES, seed=3)
    settings = IdentifySettings(maximum_likelihood=False)
    free = _identified(runs, settings)["fidim_free"]
    return free, _identified(runs, replace(settings, consistent=True))["fidim_free"]


def _identified(runs: list[SwingRun], settings: IdentifySettings) -> dict[str, Estimate]:
    return identify(runs, paper_model().robot, settings).estimates


@pytest.mark.slow
@pytest.mark.parametrize("method", ["likely", "published"])
def test_estimates_are_held_to_possible_bodies(method: str, request: pytest.FixtureRequest):
    free, held = request.getfixturevalue(method)
    assert not free.consistency.is_possible, f"{free.consistency}"
    assert any("no body can have" in note for note in free.notes), f"{free.notes}"
    assert held.consistency.is_possible, f"{held.consistency}"
    assert held.held_cost is not None, "not held"
    assert 0.0 < held.held_cost < 9.0, f"the constraint costs {held.held_cost}"
    assert any("held to the inertia" in note for note in held.notes), f"{held.notes}"


@pytest.mark.slow
def test_holding_brings_maximum_likelihood_no_farther_from_the_truth(likely: Pair):
    free, held = likely
    off = [one.values - thin_plate() for one in likely]
    was, now = (float(one @ np.linalg.solve(free.covariance, one)) for one in off)
    assert now < was, f"squared distance in the free estimate's metric {now:.2f}, {was:.2f} before"
    z = off[1] / held.std
    assert np.abs(z).max() < 4.0, f"z-scores {np.round(z, 1)}"


@pytest.mark.slow
def test_consistent_at_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    write_robot(tmp_path / "robot.toml", paper_model().robot)
    runs = []
    for run in thin_swings(("x", "y"), seed=8):
        write_csv(tmp_path / f"{run.name}.csv", run.trajectory)
        told = {"role": "identify", "trajectory": f"{run.name}.csv", "window_s": [0.0, 5.0]}
        runs.append(
            {
                "name": run.name,
                **told,
                "cable_lengths_m": run.lengths_m,
                "cable_lengths_std_m": 5e-4,
            }
        )
    dump_toml(
        tmp_path / "session.toml",
        {
            "format": "freeswing-session/1",
            "name": "thin",
            "robot": "robot.toml",
            "runs": runs,
        },
    )
    status = main(["identify", str(tmp_path), "--consistent"])
    said = capsys.readouterr()
    assert status == 0, said.err
    assert "held to the inertia of a possible body" in said.out + said.err
    text = (tmp_path / "results" / "identification.json").read_text(encoding="utf-8")
    entry = json.loads(text)["estimates"]["ml_free"]["consistency"]
    assert entry["possible"], f"{entry}"
    assert entry["held"], f"{entry}"
