"""A robot file that is wrong widens the inertia's deviations by what the residuals say it is."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.ident.identify import Identification, IdentifySettings, identify
from freeswing.ident.judge.wrong_geometry import WrongGeometry, likely_size, with_wrong_geometry
from freeswing.ident.runs import SwingRun
from freeswing.main import main
from tests.ident.swings import (
    PAPER_LENGTHS_M,
    TRUE_INERTIA,
    paper_model,
    recorded,
    tilted_release,
)
from tests.oracle.recorded.sessions import make_session

ROBOT = paper_model().robot


@pytest.mark.parametrize(("size", "colour"), [(0.0, 1.0), (0.0, 8.0), (1.0, 1.0), (30.0, 8.0)])
def test_the_size_of_errors_is_found(size, colour):
    """Within what 36 numbers tell; none where there are none, whatever colour residuals have."""
    generator = np.random.default_rng(3)
    answers = np.geomspace(300.0, 1e-3, 36)
    for _ in range(20):
        seen = np.sqrt(colour) * generator.standard_normal(36)
        seen += size * answers * generator.standard_normal(36)
        found = likely_size(answers, seen, colour)
        assert 0.5 * size <= found <= 2.0 * size, (found, size)


@pytest.mark.parametrize(("times", "sure"), [(3.60, False), (3.66, True)])
def test_chance_makes_errors_likelier_in_one_session_of_a_thousand(times, sure):
    """One number of many stands out; the rest settles the noise."""
    answers = np.append(1.0, np.zeros(400))
    seen = np.append(times, np.ones(400))
    assert (likely_size(answers, seen, 1.0) > 0.0) == sure


@cache
def identified(radius: float) -> Identification:
    """Three swings of the paper's robot; its pulleys given so many times their radius."""
    generator = np.random.default_rng(5)
    runs: list[SwingRun] = []
    for k in (2, 5, 7):
        motion = tilted_release(build_model(ROBOT), PAPER_LENGTHS_M[k], 0.08, 3.0)
        run = recorded(motion, f"swing-{k}", generator, 1e-4, POSE_COORDINATES, "identify")
        runs.append(replace(run, lengths_m=None, lengths_std_m=None))
    cables = tuple(
        replace(one, pulley_radius_m=radius * one.pulley_radius_m) for one in ROBOT.cables
    )
    return identify(runs, replace(ROBOT, cables=cables), IdentifySettings(predict=False))


def test_deviations_hold_diameters_given_for_radii():
    for name, one in identified(2.0).estimates.items():
        z = (one.values - TRUE_INERTIA) / one.std
        assert np.abs(z).max() < 3.0, f"{name}: {np.round(z, 1)}"
        assert min(one.extra["geometry_std"]) > 0.0, name
    told = identified(2.0).estimates["ml_full"]
    z = (told.values - TRUE_INERTIA) / np.sqrt(told.std**2 - np.square(told.extra["geometry_std"]))
    assert np.abs(z).max() > 6.0, f"without it: {np.round(z, 1)}"
    assert any("times their tolerances" in note for note in told.notes)


def test_a_robot_file_that_is_right_widens_nothing():
    for name, one in identified(1.0).estimates.items():
        assert "geometry_std" not in one.extra, name
        assert not any("times their tolerances" in note for note in one.notes), name


def test_what_is_told_beside_the_values_follows_the_wider_deviations():
    """Whether they are known, and whether a body can have them."""
    exact = identified(1.0).estimates["ml_full"]
    assert with_wrong_geometry(exact, WrongGeometry(0.0, np.zeros((9, 9)))) is exact
    off = replace(exact, values=exact.values - np.array([0, 0, 0, 0, 0, 0.08, 0, 0, 0]))
    off = replace(off, notes=(off.consistency.sentence(),))
    wide = with_wrong_geometry(off, WrongGeometry(5.0, np.diag(np.full(9, 0.1**2))))
    assert off.consistency.is_refuted
    assert not wide.consistency.is_refuted
    assert off.notes[0] not in wide.notes
    assert wide.notes[-1] == wide.consistency.sentence()
    assert wide.extra["geometry_std"] == pytest.approx([0.1] * 9)
    assert not wide.essential[6:].any(), "products of inertia, not known any more"


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["bologna-4", "three-cable"])
@pytest.mark.parametrize("wrong", ["radius", "anchor", "attachment"])
def test_no_number_of_a_wrong_robot_file_is_wrong_and_sure(tmp_path: Path, robot: str, wrong: str):
    """Through the command, on sessions of the independent integrator by their free coordinates."""
    truth = make_session(tmp_path, 77, robot, pose=False, n_runs=7, duration_s=6.0)
    path = tmp_path / "robot.toml"
    text = path.read_text()
    if wrong == "radius":
        text = text.replace("pulley_radius_m = 0.025", "pulley_radius_m = 0.0125")
    else:
        key, off = {"anchor": ("entry_m", 0.03), "attachment": ("attachment_m", 0.012)}[wrong]
        old = re.search(rf"^{key} = (.*)$", text, re.MULTILINE)
        assert old is not None
        moved = [value + off for value in json.loads(old[1])]
        text = text.replace(old[0], f"{key} = {moved}")
    path.write_text(text)
    assert main(["identify", str(tmp_path)]) == 0
    told = json.loads((tmp_path / "results" / "identification.json").read_text())
    body = truth.body
    true = np.concatenate([body.com_m, body.specific_inertia_m2])
    for name, one in told["estimates"].items():
        rows = one["parameters"][:9]
        z = [(row["value"] - at) / row["std"] for row, at in zip(rows, true, strict=True)]
        assert np.abs(z).max() < 3.5, f"{name}: {np.round(z, 1)}"
