"""A robot file that is wrong widens the inertia's deviations by what the residuals say it is."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import POSE_COORDINATES, Robot
from freeswing.ident import identify as whole
from freeswing.ident.fidim import fidim_stage
from freeswing.ident.identify import Identification, IdentifySettings, identify
from freeswing.ident.judge import wrong_geometry as room
from freeswing.ident.judge.asked_errors import GEOMETRY, asked_errors
from freeswing.ident.judge.wrong_geometry import WrongGeometry, with_wrong_geometry
from freeswing.ident.likelihood.blocks import first_unknowns
from freeswing.ident.likelihood.cable_ends import GeometryPriors
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_swings import ONWARD, Swings
from freeswing.ident.likelihood.samples_and_noise import prepare
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


@cache
def identified(radius: float) -> Identification:
    """Three swings of the paper's robot; its pulleys given so many times their radius."""
    return identify(swings(2, 5, 7), with_radii(radius), IdentifySettings(predict=False))


def swings(*places: int, duration_s: float = 3.0) -> list[SwingRun]:
    """At 0.1 mm of noise, without lengths."""
    generator, runs = np.random.default_rng(5), []
    for k in places:
        motion = tilted_release(build_model(ROBOT), PAPER_LENGTHS_M[k], 0.08, duration_s)
        run = recorded(motion, f"swing-{k}", generator, 1e-4, POSE_COORDINATES, "identify")
        runs.append(replace(run, lengths_m=None, lengths_std_m=None))
    return runs


def with_radii(factor: float) -> Robot:
    cables = (replace(one, pulley_radius_m=factor * one.pulley_radius_m) for one in ROBOT.cables)
    return replace(ROBOT, cables=tuple(cables))


def test_deviations_hold_diameters_given_for_radii():
    for name, one in identified(2.0).estimates.items():
        z = (one.values - TRUE_INERTIA) / one.std
        assert np.abs(z).max() < 3.0, f"{name}: {np.round(z, 1)}"
        assert min(one.extra["geometry_std"]) > 0.0, name
    told = identified(2.0).estimates["ml_full"]
    z = (told.values - TRUE_INERTIA) / np.sqrt(told.std**2 - np.square(told.extra["geometry_std"]))
    assert np.abs(z).max() > 6.0, f"without it: {np.round(z, 1)}"
    assert any("times their tolerances" in note for note in told.notes)


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_deviations_hold_them_beside_ends_that_may_be_anywhere(factor: float) -> None:
    """By x and y alone residuals ask for nothing, which full poses of the same runs do."""
    settings = IdentifySettings(predict=False, geometry=GeometryPriors(0.02))
    for name, one in identify(swings(2, 5, 7), with_radii(factor), settings).estimates.items():
        z = (one.values - TRUE_INERTIA) / one.std
        assert np.abs(z).max() < 3.0, f"{name}: {np.round(z, 1)}"


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


@pytest.mark.parametrize("std_m", [1e-4, 0.02])
def test_fidim_counts_the_size_in_what_it_was_found_in(std_m: float, monkeypatch) -> None:
    """Stated by an option or by robot.toml, which makes it the tolerance: one and the same."""
    off = whole.Fitted(
        identified(1.0).estimates["ml_full"], ROBOT, (), WrongGeometry(0.5, np.eye(9))
    )
    monkeypatch.setattr(whole, "_likelihood_estimates", lambda *_: ({"ml_full": off}, {}, False))
    runs, tolerances = swings(2, 5, duration_s=2.4), ROBOT.tolerances
    stated = replace(tolerances, entry_m=std_m, declared=("entry_m",))
    option = IdentifySettings(predict=False, geometry=GeometryPriors(std_m))
    by_option = identify(runs, ROBOT, option).estimates
    without = IdentifySettings(predict=False)
    by_file = identify(runs, replace(ROBOT, tolerances=stated), without).estimates
    for name in ("fidim_full", "fidim_free"):
        told, same = (one[name].extra["geometry_std"] for one in (by_option, by_file))
        assert told == pytest.approx(same, rel=1e-9), name


def test_the_sentence_says_what_is_counted_as_a_tolerance() -> None:
    exact = identified(1.0).estimates["ml_full"]
    stated = room._stated(GeometryPriors(0.02).model(ROBOT))
    assert stated == {"anchor_offset": 0.02}
    told = with_wrong_geometry(exact, WrongGeometry(5.0, np.eye(9), stated))
    words = "off by 5 times their tolerances (as such count 20 mm of entry points, as stated):"
    assert any(words in note for note in told.notes)
    assert room._stated(build_model(ROBOT)) == {}


def test_errors_are_as_wide_as_stated_and_else_as_their_tolerances() -> None:
    model = room.geometry_of(ROBOT, GeometryPriors(0.02))
    stds = {
        name.split(".")[0]: one.prior_std
        for name, one in zip(model.names, model.parameters, strict=True)
    }
    usual = ROBOT.tolerances
    assert stds["anchor_offset"] == 0.02
    assert stds["attachment_offset"] == usual.attachment_m
    assert stds["pulley_radius"] == usual.pulley_radius_m
    assert stds["pulley_axis"] == usual.swivel_rad


@pytest.mark.parametrize("kind", [ValueError, np.linalg.LinAlgError])
def test_a_question_that_fails_ends_no_result(kind, monkeypatch) -> None:
    def fails(_: object) -> WrongGeometry:
        raise kind("did not converge")

    monkeypatch.setattr(room, "doubts", fails)
    runs = swings(2, 5, duration_s=2.4)
    found = identify(runs, ROBOT, IdentifySettings(predict=False)).estimates
    for name in ("ml_full", "ml_free"):
        said = [note for note in found[name].notes if "(did not converge)" in note]
        assert said, name
        assert "deviations hold nothing of what errors of robot.toml" in said[0]


@pytest.mark.parametrize(("noise", "asked"), [(0.9e-6, False), (1.1e-6, True)])
def test_what_rounding_leaves_is_no_cause_s(noise: float, asked: bool, monkeypatch) -> None:
    """Swings simulated without noise: another frame had 2.8 um of a clock that is not there."""
    told = []

    def ask(found):
        told.append(found)
        return SimpleNamespace(
            answers=np.zeros((9, 3)),
            seen=np.zeros(9),
            causes={room.GEOMETRY: np.arange(3)},
            moved=np.zeros((9, 3)),
            colour=1.0,
        )

    monkeypatch.setattr(room, "asked_errors", ask)
    monkeypatch.setattr(room, "_stated", lambda _: {})
    fit: Any = SimpleNamespace(noise=np.array([noise, np.nan]), model=None)
    wrong, missing = room.doubts(fit)
    assert (wrong.size, missing.sizes) == (0.0, {})
    assert bool(told) == asked


def test_geometry_that_cannot_be_moved_leaves_fidim_there(monkeypatch) -> None:
    """What the first pass had is the second's, with the word that its deviations lack a part."""

    def fails(*_: object) -> None:
        raise ValueError("no pose fits at sample 3")

    runs = swings(2, 5, duration_s=2.4)
    monkeypatch.setattr(fidim_stage, "geometry_share", fails)
    found = identify(runs, with_radii(2.0), IdentifySettings(predict=False))
    before = identify(
        runs, with_radii(2.0), IdentifySettings(predict=False, maximum_likelihood=False)
    )
    for name in ("fidim_full", "fidim_free"):
        one = found.estimates[name]
        assert (one.values == before.estimates[name].values).all()
        assert (one.std == before.estimates[name].std).all()
        assert "geometry_std" not in one.extra
        assert any(f"{fidim_stage.NOT_HELD} (no pose fits at" in note for note in one.notes)
        assert not any(fidim_stage.NOT_HELD in note for note in before.estimates[name].notes)


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


def test_geometry_that_is_known_by_itself_is_no_error_of_the_robot_file() -> None:
    """Held attachments err by their tolerance, but for those that cable lengths have settled."""
    models = (build_model(ROBOT), build_model(ROBOT, ("attachment_offset",)))
    runs = [prepare(run, (0.0, 1.0)) for run in swings(2, 5, 7, duration_s=1.0)]
    motions = [tilted_release(models[0], PAPER_LENGTHS_M[k], 0.08, 1.0) for k in (2, 5, 7)]
    starts = np.array([np.append(one.zetas[0], one.rates[0]) for one in motions])
    held = first_unknowns(models[1], TRUE_INERTIA, starts, [None] * 3)
    block = held.block("attachment_offset")
    held = held.exchanged(replace(block, estimated=np.zeros(12, dtype=bool)))
    bare = first_unknowns(models[0], TRUE_INERTIA, starts, [None] * 3)
    asked = []
    for model, unknowns, settled in (
        (models[0], bare, []),
        (models[1], held, []),
        (models[1], held, [3, 4, 5]),
    ):
        found = fit(Swings(model, tuple(runs), np.full(2, 10.0)), unknowns, ONWARD)
        asked.append(asked_errors(found, np.array(settled, dtype=np.int64)))
        assert asked[-1].moved.shape[0] == len(found.free)
    of_bare, of_held, of_some = (one.answers[:, one.causes[GEOMETRY]] for one in asked)
    assert of_held.shape == of_bare.shape
    sizes = (np.linalg.norm(one, axis=0) for one in (of_bare, of_held))
    np.testing.assert_allclose(*map(np.sort, sizes), rtol=1e-3)
    assert of_some.shape[1] == of_held.shape[1] - 3
