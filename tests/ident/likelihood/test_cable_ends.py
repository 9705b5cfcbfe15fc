"""Cable ends that are known only so well: estimated with the inertia, and its deviations honest."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.files.documents import DataError, dump_toml
from freeswing.cdpr.files.robot_file import write_robot
from freeswing.cdpr.files.trajectory_csv import write_csv
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import POSE_COORDINATES, Robot
from freeswing.cdpr.tolerances import Tolerances
from freeswing.ident.estimate import Estimate
from freeswing.ident.identify import Identification, IdentifySettings, identify
from freeswing.ident.likelihood.cable_ends import GeometryPriors, corrected
from freeswing.ident.runs import SwingRun
from freeswing.main import main
from tests.ident.swings import (
    PAPER_LENGTHS_M,
    TRUE_INERTIA,
    paper_model,
    recorded,
    tilted_release,
)

ROBOT = paper_model().robot
STD_M = 1e-3
EQUILIBRIA = (2, 5, 7, 9, 11)
CHECKED = (6, 8)


def displaced(generator: np.random.Generator) -> Robot:
    """The paper's robot with all cable ends off by a millimetre in every coordinate."""
    cables = tuple(
        replace(
            cable,
            entry_m=cable.entry_m + STD_M * generator.standard_normal(3),
            attachment_m=cable.attachment_m + STD_M * generator.standard_normal(3),
        )
        for cable in ROBOT.cables
    )
    return replace(ROBOT, cables=cables)


@cache
def swings() -> tuple[SwingRun, ...]:
    """Poses of a displaced robot, 0.1 mm of noise; lengths are those of the poses."""
    generator = np.random.default_rng(12)
    model, runs = build_model(displaced(generator)), []
    for k in (*EQUILIBRIA, *CHECKED):
        motion = tilted_release(model, PAPER_LENGTHS_M[k], 0.08, 5.0)
        role = "identify" if k in EQUILIBRIA else "validate"
        run = recorded(motion, f"swing-{k}", generator, 1e-4, POSE_COORDINATES, role)
        runs.append(replace(run, lengths_m=None, lengths_std_m=None))
    return tuple(runs)


@cache
def identified(priors: GeometryPriors) -> Identification:
    return identify(list(swings()), ROBOT, IdentifySettings(geometry=priors))


def z_scores(found: Estimate) -> np.ndarray:
    return (found.values - TRUE_INERTIA) / found.std


@pytest.mark.slow
def test_deviations_are_honest_where_the_geometry_is_let_free():
    """Taken as exact, a millimetre makes errors that no deviations between runs hold.

    All swings share the same wrong ends; what the residuals ask for holds them.
    """
    told = identified(GeometryPriors()).estimates["ml_full"]
    exact, std = z_scores(told), np.sqrt(told.std**2 - np.square(told.extra["geometry_std"]))
    between_runs = (told.values - TRUE_INERTIA) / std
    free = z_scores(identified(GeometryPriors(STD_M, STD_M)).estimates["ml_full"])
    assert np.abs(free).max() < 3.5, f"geometry free: z-scores {np.round(free, 1)}"
    assert np.abs(exact).max() < 3.0, f"geometry exact: z-scores {np.round(exact, 1)}"
    assert np.abs(between_runs).max() > 4.0, f"between runs: z-scores {np.round(between_runs, 1)}"


@pytest.mark.slow
def test_fidims_deviations_hold_cable_ends_of_known_spread():
    exact = identified(GeometryPriors()).estimates
    free = identified(GeometryPriors(STD_M, STD_M)).estimates
    for name in ("fidim_full", "fidim_free"):
        assert (free[name].values == exact[name].values).all(), "the published solution stays"
        z = z_scores(free[name])
        assert np.abs(z).max() < 3.0, f"{name}: z-scores {np.round(z, 1)}"


def test_tolerances_that_robot_toml_states_reach_fidim():
    """In proportion to what is stated; what is not stated is taken as exact."""

    def share(robot: Robot, priors: GeometryPriors | None = None) -> np.ndarray:
        settings = IdentifySettings(
            maximum_likelihood=False, predict=False, geometry=priors or GeometryPriors()
        )
        found = identify(list(swings()[:3]), robot, settings).estimates["fidim_full"]
        stds = found.extra.get("tolerances_std", np.zeros(9))
        assert (np.array(stds) <= found.std).all()
        return np.array(stds)

    known = replace(ROBOT, tolerances=Tolerances(attachment_m=2e-4))
    assert (share(known) == 0.0).all(), "not stated"
    known = replace(ROBOT, tolerances=Tolerances(attachment_m=2e-4, declared=("attachment_m",)))
    stated = share(known)
    assert (stated > 0.0).all(), f"{stated}"
    option = share(known, GeometryPriors(None, 4e-4))
    assert option == pytest.approx(2.0 * stated, rel=0.02), "an option comes first"


def test_a_stated_tolerance_that_cannot_be_is_named():
    robot = replace(ROBOT, tolerances=Tolerances(entry_m=0.2, declared=("entry_m",)))
    with pytest.raises(DataError, match=r"\[tolerances\].*entry_std_m is 0.2"):
        identify(list(swings()[:3]), robot)


@pytest.mark.slow
def test_held_out_runs_are_predicted_by_the_corrected_robot():
    exact, free = (
        np.array([run.prediction_rmse_m for run in identified(priors).validation], dtype=float)
        for priors in (GeometryPriors(), GeometryPriors(STD_M, STD_M))
    )
    assert len(free) == len(CHECKED), f"{free}"
    assert (free < exact).all(), f"off by {free} m, {exact} m with the declared geometry"
    assert free.max() < 1.15e-4, f"off by {free} m where the noise is 1e-4"


@pytest.mark.slow
def test_corrections_are_reported_and_within_their_deviations():
    document = identified(GeometryPriors(STD_M, STD_M)).document()
    rows = document["estimates"]["ml_full"]["geometry"]
    truth = displaced(np.random.default_rng(12))
    ends = np.concatenate(
        [
            (truth.entries_m - ROBOT.entries_m).ravel(),
            (truth.attachments_m - ROBOT.attachments_m).ravel(),
        ]
    )
    assert len(rows) == 24, f"{len(rows)} corrections"
    z = [(row["value"] - true) / row["std"] for row, true in zip(rows, ends, strict=True)]
    assert np.abs(z).max() < 4.0, f"z-scores {np.round(z, 1)}"
    assert all(row["std"] <= 1.01 * row["prior_std"] for row in rows), f"{rows}"


def test_options_reach_the_fit_from_the_command_line(tmp_path: Path):
    write_robot(tmp_path / "robot.toml", ROBOT)
    rows = []
    for run in swings()[:3]:
        write_csv(tmp_path / f"{run.name}.csv", run.trajectory)
        row = {"name": run.name, "role": run.role, "trajectory": f"{run.name}.csv"}
        rows.append({**row, "window_s": list(run.window_s or ())})
    head = {"format": "freeswing-session/1", "name": "off", "robot": "robot.toml"}
    dump_toml(tmp_path / "session.toml", {**head, "runs": rows})
    assert main(["identify", str(tmp_path), "--attachment-std-m", "0.001", "--quiet"]) == 0
    text = (tmp_path / "results" / "identification.json").read_text(encoding="utf-8")
    estimates = json.loads(text)["estimates"]
    assert min(estimates["fidim_full"]["tolerances_std"]) > 0.0
    names = {row["name"] for row in estimates["ml_full"]["geometry"]}
    assert len(names) == 12, f"{names}"
    assert "attachment_offset.offset_1_x_m" in names, f"{names}"


@pytest.mark.parametrize("std", ["-0.001", "nan", "5"])
def test_impossible_deviations_are_wrong_usage(
    std: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    write_robot(tmp_path / "robot.toml", ROBOT)
    write_csv(tmp_path / "a.csv", swings()[0].trajectory)
    row = {"name": "a", "role": "identify", "trajectory": "a.csv"}
    head = {"format": "freeswing-session/1", "name": "off", "robot": "robot.toml"}
    dump_toml(tmp_path / "session.toml", {**head, "runs": [row]})
    try:
        status = main(["identify", str(tmp_path), "--entry-std-m", std])
    except SystemExit as ended:  # what is no number above 0 does not pass the parser
        status = ended.code
    said = capsys.readouterr().err
    assert status == 2, f"status {status}: {said}"
    assert "--entry-std-m" in said, said
    assert "above 0" in said, said


def test_the_corrected_robot_has_its_ends_moved():
    priors = GeometryPriors(entry_std_m=0.002)
    model = priors.model(ROBOT)
    moved = corrected(ROBOT, model, 1e-3 * np.arange(12.0))
    gap = np.abs(moved.entries_m - ROBOT.entries_m - 1e-3 * np.arange(12.0).reshape(4, 3)).max()
    assert gap < 1e-12, f"off by {gap}"
    assert (moved.attachments_m == ROBOT.attachments_m).all(), "attachments moved too"
    spread = {parameter.prior_std for parameter in model.parameters}
    assert spread == {0.002}, f"{spread}"
