"""The whole of identify on simulated swings: recovery, documents, drops, verdicts, refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import INERTIA_NAMES, POSE_COORDINATES, Platform
from freeswing.ident.fidim.weighted_least_squares import noisy_regressor, weighted_fidim
from freeswing.ident.identify import Identification, IdentifySettings, identify
from freeswing.ident.runs import Payload, SwingRun
from freeswing.ident.signals.derivatives import SignalSettings, signals_of
from freeswing.ident.signals.motions import free_motion, full_motion
from freeswing.ident.signals.usable_runs import guessed_inertia, prepare_runs
from tests.ident.swings import REGULAR, TRUE_INERTIA, paper_model, recorded, swing

FIDIM = IdentifySettings(maximum_likelihood=False, predict=False)
ROBOT = paper_model().robot


def nine(
    coordinates=("x", "y"), noise_m: float = 1e-5, seed: int = 0, **more: Any
) -> list[SwingRun]:
    """One swing about each regular equilibrium, small enough to be nearly sinusoidal."""
    generator = np.random.default_rng(seed)
    return [
        recorded(swing(k, 0.02, 0.015), f"swing-{k:02d}", generator, noise_m, coordinates, **more)
        for k in REGULAR
    ]


@pytest.fixture(scope="module")
def by_poses() -> Identification:
    runs = nine(POSE_COORDINATES)
    runs += [recorded(swing(5, 0.015, -0.02), "check-1", None, 0.0, POSE_COORDINATES, "validate")]
    return identify(runs, ROBOT, FIDIM)


@pytest.mark.parametrize("name", ["fidim_full", "fidim_free"])
def test_inertia_is_recovered_within_what_smoothing_allows(by_poses: Identification, name: str):
    """10 um of noise: the essential parameters come out to a few percent, com_z to 1 %."""
    values = by_poses.estimates[name].values
    error = np.abs(values - TRUE_INERTIA) / np.abs(TRUE_INERTIA)
    assert error[2] < 0.01, f"com_z off by {100 * error[2]:.2f} %"
    assert (error[3:6] < 0.04).all(), f"inertia off by {100 * error[3:6]} %"


def test_free_and_full_are_compared_and_agree(by_poses: Identification):
    rows = {row.name: row for row in by_poses.comparison["fidim"]}
    assert {"com_z_m", "Ixx_m2", "Iyy_m2", "Izz_m2"} <= rows.keys(), f"{rows.keys()}"
    assert rows["com_z_m"].difference_percent < 1.0, f"{rows['com_z_m']}"


def test_validation_is_of_the_best_estimate_and_lists_the_check_run(by_poses: Identification):
    assert by_poses.best == "fidim_full"
    (check,) = by_poses.validation
    assert check.run == "check-1", check
    sigma_W = by_poses.estimates["fidim_full"].sigma_W
    assert sigma_W is not None
    assert check.sigma_perp < 3.0 * sigma_W, f"{check.sigma_perp} against {sigma_W}"


def test_the_document_is_the_contract(by_poses: Identification):
    document = by_poses.document()
    text = json.dumps(document, allow_nan=False)
    assert document["format"] == "freeswing-identification/1"
    entry = document["estimates"]["fidim_full"]
    assert [row["name"] for row in entry["parameters"]] == list(INERTIA_NAMES), text[:200]
    wanted = {"name", "value", "std", "std_percent", "essential"}
    assert set(entry["parameters"][0]) == wanted, entry["parameters"][0]
    assert {"sigma_W", "cost_C", "samples", "dropped_runs"} <= entry.keys(), entry.keys()
    assert {"name", "difference_percent", "z"} <= document["comparison"]["fidim"][0].keys()
    fields = {"run", "sigma_perp", "prediction_rmse_m", "noise_floor_m"}
    assert fields <= document["validation"][0].keys(), document["validation"]


def test_free_coordinates_alone_give_no_full_estimate():
    found = identify(nine(), ROBOT, FIDIM)
    assert list(found.estimates) == ["fidim_free"], f"{list(found.estimates)}"
    assert found.comparison == {}, f"{found.comparison}"
    error = abs(found.estimates["fidim_free"].values[2] / TRUE_INERTIA[2] - 1.0)
    assert error < 0.01, f"com_z off by {100 * error:.2f} %"


def test_nothing_but_the_geometry_is_needed_of_the_robot():
    bare = replace(ROBOT, platform=Platform())
    found = identify(nine(), bare, FIDIM)
    error = abs(found.estimates["fidim_free"].values[2] / TRUE_INERTIA[2] - 1.0)
    assert error < 0.01, f"com_z off by {100 * error:.2f} %"
    assert np.isfinite(guessed_inertia(bare)).all(), f"{guessed_inertia(bare)}"


@pytest.mark.slow
def test_free_coordinates_can_be_chosen_by_the_program():
    found = identify(nine(POSE_COORDINATES), replace(ROBOT, free_coordinates=None), FIDIM)
    assert len(found.free_coordinates) == 2, f"{found.free_coordinates}"
    assert found.amplification < 2.0, f"{found.free_coordinates}: {found.amplification}"
    error = abs(found.estimates["fidim_free"].values[2] / TRUE_INERTIA[2] - 1.0)
    assert error < 0.02, f"com_z off by {100 * error:.2f} %"


def test_bad_runs_are_dropped_by_name_with_a_number():
    runs = nine(POSE_COORDINATES)
    times = np.arange(1001) / 100.0
    generator = np.random.default_rng(0)
    rest = signals_of(runs[0]).values.mean(axis=0)
    still = rest + 1e-5 * generator.standard_normal((1001, 6))
    hidden = np.array(runs[1].trajectory.values)
    hidden[100:800] = np.nan
    unlocked = np.array(runs[2].trajectory.values)
    unlocked[:, 2] += 0.06 * times / 10.0
    for name, values in (("still", still), ("hidden", hidden), ("unlocked", unlocked)):
        trajectory = Trajectory(times, POSE_COORDINATES, values, None, "made")
        runs.append(SwingRun(name, "identify", trajectory, None, None, (0.0, 10.0)))
    found = identify(runs, ROBOT, FIDIM)
    why = {drop.run: drop.why for drop in found.estimates["fidim_full"].dropped}
    assert set(why) == {"still", "hidden", "unlocked"}, f"{why}"
    assert "times the noise" in why["still"], why["still"]
    assert "70 % of its samples" in why["hidden"], why["hidden"]
    assert "mm" in why["unlocked"], why["unlocked"]


def test_a_cable_that_pushes_is_called_slack():
    """A run on a platform hung so that one cable would have to push leaves, named, with tension."""
    runs = nine(POSE_COORDINATES)
    times = np.arange(1001) / 100.0
    values = np.array(runs[3].trajectory.values)
    mean = values.mean(axis=0)
    fast = mean + (values - mean) * np.array([6.0, 6.0, 6.0, 6.0, 6.0, 6.0])
    trajectory = Trajectory(times, POSE_COORDINATES, fast, None, "made")
    runs.append(SwingRun("wild", "identify", trajectory, None, None, (0.0, 10.0)))
    found = identify(runs, ROBOT, FIDIM)
    why = {drop.run: drop.why for drop in found.estimates["fidim_full"].dropped}
    assert "wild" in why, f"{why}"
    assert "slack" in why["wild"], why["wild"]


def test_a_singular_choice_of_free_coordinates_is_named():
    runs = nine(POSE_COORDINATES)[:5]
    prepared = prepare_runs(runs, paper_model(), SignalSettings())
    assert prepared.amplification < 20.0, f"{prepared.amplification}"
    sloped = replace(ROBOT, free_coordinates=("x", "z"))
    found = identify(runs, sloped, FIDIM)
    dropped = {drop.run: drop.why for drop in found.estimates["fidim_full"].dropped}
    assert dropped == {}, f"{dropped}"
    notes = " ".join(found.notes)
    left = found.estimates.get("fidim_free")
    text = notes if left is None else " ".join(drop.why for drop in left.dropped)
    assert "x, z" in text, f"{text}"


@pytest.mark.slow
def test_the_mass_comes_from_payload_runs():
    payload = Payload(1.0, np.array([0.25, 0.1, 0.05]))
    mass = 8.0
    loaded = tuple(_with_payload(TRUE_INERTIA, payload, mass))
    generator = np.random.default_rng(4)
    runs = nine(POSE_COORDINATES) + [
        recorded(
            swing(k, 0.02, 0.015, inertia=loaded),
            f"loaded-{k}",
            generator,
            1e-5,
            POSE_COORDINATES,
            payload=payload,
        )
        for k in REGULAR
    ]
    found = identify(runs, ROBOT, FIDIM).estimates["fidim_full"]
    rows = {row["name"]: row for row in found.document()["parameters"]}
    off = abs(rows["mass_kg"]["value"] - mass)
    assert off < max(0.05 * mass, 2.0 * rows["mass_kg"]["std"]), f"{rows['mass_kg']}"
    error = abs(found.values[0] - TRUE_INERTIA[0])
    assert error < 5e-4, f"the payload leaked into com_x: off by {error} m"


def _with_payload(inertia: np.ndarray, payload: Payload, mass: float) -> np.ndarray:
    """Specific inertia of platform and point mass together."""
    p = payload.position_m
    point = p @ p * np.eye(3) - np.outer(p, p)
    entries = point[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    other = np.concatenate([p, entries])
    return (mass * inertia + payload.mass_kg * other) / (mass + payload.mass_kg)


def test_the_weighted_form_covers_where_the_published_one_cannot():
    """Signals with their own noise, no smoothing bias: z-scores of the weighted form are fair."""
    model = paper_model()
    scores = []
    for seed in range(3):
        runs = nine(noise_m=3e-5, seed=seed)
        noisy = []
        for run, k in zip(runs, REGULAR, strict=True):
            signals = signals_of(run, SignalSettings(pass_hz=12.0, stop_hz=21.0))
            truth = swing(k, 0.02, 0.015).at(signals.times_s)
            assert run.lengths_m is not None
            motion = free_motion(model, signals, run.lengths_m, truth[0][0])
            noisy.append(noisy_regressor(model, signals, motion))
        found = weighted_fidim(noisy, TRUE_INERTIA)
        scores.append((found.values - TRUE_INERTIA) / np.sqrt(np.diag(found.covariance)))
    spread = np.sqrt(np.mean(np.square(scores)))
    assert 0.6 < spread < 1.6, f"z-scores of the weighted form spread {spread}"


def test_samples_without_noise_have_no_weighted_form_and_say_so():
    runs = [
        replace(
            run,
            trajectory=replace(run.trajectory, covariances=np.zeros((1001, 2, 2))),
        )
        for run in nine(noise_m=0.0)
    ]
    found = identify(runs, ROBOT, replace(FIDIM, weighting="covariance"))
    notes = " ".join(found.estimates["fidim_free"].notes)
    assert "the weighted form cannot be had" in notes, f"{notes!r}"


def test_validation_runs_are_never_fitted():
    runs = nine()
    wrong = [replace(run, role="validate") for run in nine(noise_m=5e-4, seed=9)]
    one = identify(runs, ROBOT, FIDIM).estimates["fidim_free"].values
    two = identify(runs + wrong, ROBOT, FIDIM).estimates["fidim_free"].values
    assert (one == two).all(), f"validation runs changed the estimate by {two - one}"


@pytest.mark.parametrize(
    ("runs", "message"),
    [
        ([], "nothing to identify from"),
        ([replace(nine()[0], lengths_m=None)], "cable_lengths_m is not given"),
        ([replace(nine()[0], lengths_m=np.ones(3))], "holds 3 lengths"),
    ],
)
def test_hopeless_sessions_are_refused_in_words(runs: list[SwingRun], message: str):
    with pytest.raises(DataError, match=message):
        identify(runs, ROBOT, FIDIM)


def test_a_single_tiny_swing_is_refused_in_words():
    generator = np.random.default_rng(0)
    run = recorded(swing(11, 4e-4, 2e-4), "tiny", generator, 1e-4, POSE_COORDINATES)
    with pytest.raises(DataError, match="no inertial parameter can be identified"):
        identify([run], ROBOT, FIDIM)


def test_full_and_free_motions_agree_on_the_same_swing():
    model = paper_model()
    run = recorded(swing(7, 0.02, 0.015), "r", None, 0.0, POSE_COORDINATES)
    signals = signals_of(run, SignalSettings(pass_hz=12.0, stop_hz=21.0))
    full = full_motion(model, signals, ("x", "y"))
    free = free_motion(model, signals.select(("x", "y")), full.lengths_m, full.zetas[0])
    gap = np.abs(full.accelerations - free.accelerations).max()
    assert gap < 0.02 * np.abs(full.accelerations).max(), f"accelerations differ by {gap}"


@pytest.mark.slow
def test_both_methods_on_nine_swings():
    """Maximum likelihood beside FIDIM: the truth lies within its own, far smaller, intervals."""
    runs = nine(noise_m=1e-4)
    runs.append(recorded(swing(5, 0.015, -0.02), "check", np.random.default_rng(8), 1e-4))
    runs[-1] = replace(runs[-1], role="validate")
    found = identify(runs, ROBOT)
    best = found.estimates["ml_free"]
    z = (best.values - TRUE_INERTIA) / best.std
    assert found.best == "ml_free", found.best
    assert np.abs(z).max() < 4.0, f"z-scores {z}"
    assert best.std[2] < 0.3 * found.estimates["fidim_free"].std[2], f"{best.std}"
    (check,) = found.validation
    assert check.prediction_rmse_m is not None
    assert check.prediction_rmse_m < 2e-4, f"off by {check.prediction_rmse_m} m"
