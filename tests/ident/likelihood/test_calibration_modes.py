"""The cameras' calibration among the unknowns of identification."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.measured.pose_errors import TERMS, PoseErrors
from freeswing.cdpr.model.regressor import regressor
from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.cdpr.rotation import matrix_from_angles
from freeswing.ident.fidim.calibration_share import calibration_share
from freeswing.ident.fidim.shares import Stack
from freeswing.ident.identify import identify
from freeswing.ident.judge.prediction import predict
from freeswing.ident.likelihood.blocks import INERTIA, MODES
from freeswing.ident.likelihood.calibration_modes import (
    BesideModes,
    freed,
    mode_shifts,
    with_calibration,
)
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_swings import ONWARD
from freeswing.ident.likelihood.session_estimates import ml_estimate
from freeswing.ident.runs import SwingRun
from freeswing.ident.signals.derivatives import SignalSettings
from freeswing.ident.signals.usable_runs import PreparedRun, motion_of, prepare_runs
from tests.ident.swings import TRUE_INERTIA, paper_model, recorded, swing

SHIFT_M, TURN_RAD, SCALE = 1e-4, 1e-4, 1e-4
NOISE_M = 1e-5
EQUILIBRIA = (3, 6, 9)
CENTRE_M = np.array([1.2, -0.2, 0.0])


def modes() -> Array:
    """A base frame shifted and turned about the workspace's centre, and a wrong scale: seven."""
    found = np.zeros((7, 6, TERMS))
    for k in range(3):
        found[k, k, 0] = SHIFT_M
        turn = TURN_RAD * np.eye(3)[k]
        found[3 + k, 3 + k, 0] = TURN_RAD
        found[3 + k, :3, 1:4] = np.cross(turn, np.eye(3)).T
    found[6, :3, 1:4] = SCALE * np.eye(3)
    return found


def errors_of(run: SwingRun) -> PoseErrors:
    """The same base-frame errors, written about the run's first pose."""
    about = run.trajectory.positions()[0]
    here = modes()
    here[:, :, 0] += np.einsum("rab,b->ra", here[:, :, 1:4], about - CENTRE_M)
    turned = matrix_from_angles(run.trajectory.values[0, 3:])
    return PoseErrors(about, turned, here)


def runs(amplitudes: Array, seed: int, duration_s: float = 3.0) -> list[SwingRun]:
    """Swings as cameras saw them whose calibration is off by these amplitudes."""
    generator = np.random.default_rng(seed)
    found = []
    for k in EQUILIBRIA:
        motion = swing(k, duration_s=duration_s)
        run = recorded(motion, f"swing-{k}", generator, NOISE_M, POSE_COORDINATES)
        errors = errors_of(run)
        zetas, rates, _ = motion.at(run.trajectory.times_s)
        off = mode_shifts(zetas, rates, errors) @ amplitudes
        trajectory = replace(run.trajectory, values=run.trajectory.values + off)
        found.append(replace(run, trajectory=trajectory, pose_errors=errors))
    return found


def prepared(found: list[SwingRun]) -> list[PreparedRun]:
    return list(prepare_runs(found, paper_model(), SignalSettings()).runs)


@pytest.fixture(scope="module")
def estimates():
    """With the calibration's errors among the unknowns, and without."""
    generator = np.random.default_rng(5)
    ready = prepared(runs(generator.standard_normal(7), seed=6))
    blind = [replace(one, run=replace(one.run, pose_errors=None)) for one in ready]
    told = ml_estimate(paper_model(), ready, None, TRUE_INERTIA)
    return told, ml_estimate(paper_model(), blind, None, TRUE_INERTIA)


def test_the_inertia_is_within_three_claimed_deviations(estimates) -> None:
    told, _ = estimates[0]
    z = (told.values - TRUE_INERTIA) / told.std
    assert np.abs(z).max() < 3.5, f"z = {np.round(z, 2)}"


def test_left_out_the_calibration_is_claimed_to_be_inertia(estimates) -> None:
    """The negative control: without the modes, errors are many times what is claimed."""
    (told, _), (blind, _) = estimates
    z = (blind.values - TRUE_INERTIA) / blind.std
    assert np.abs(z).max() > 6.0, f"z = {np.round(z, 2)}"
    gain = np.abs(blind.values - TRUE_INERTIA)[2] / np.abs(told.values - TRUE_INERTIA)[2]
    assert gain > 3.0, f"com_z's error falls {gain:.1f} times"


def test_the_result_file_tells_the_modes(estimates) -> None:
    told, blind = estimates[0][0], estimates[1][0]
    assert len(told.document()["calibration_modes"]["amplitudes"]) == 7, told.extra
    assert "calibration_modes" not in blind.document(), blind.extra


def test_a_calibration_that_must_be_far_off_is_said(estimates) -> None:
    """Base tags surveyed 2 mm off: twenty standard deviations."""
    found = runs(np.array([20.0, 0, 0, 0, 0, 0, 0]), seed=8, duration_s=2.0)
    told, _ = ml_estimate(paper_model(), prepared(found), None, TRUE_INERTIA)
    assert any("errors of all poses together" in note for note in told.notes), told


def test_without_known_errors_nothing_changes(estimates) -> None:
    _, fitted = estimates[1]
    assert with_calibration(fitted) is fitted, "another fit"


def test_camera_modes_are_a_block_of_the_solution(estimates) -> None:
    """By name beside all others, their covariance with these in it; others' is as it was."""
    told, found = estimates[0]
    assert MODES in found.unknowns
    assert found.covariance.shape == (16, 16)
    assert found.rank == found.free.sum() == len(found.singular_values) == 16
    np.testing.assert_array_equal(found.value(MODES), told.calibration)
    assert told.extra["calibration_modes"]["std"] == found.std(MODES).tolist()
    # What the swings leave open of the inertia goes with what they leave open of the modes.
    both = found.covariance_of(INERTIA, MODES)
    sizes = np.sqrt(np.diag(both))
    assert np.abs(both / np.outer(sizes, sizes))[:9, 9:].max() > 0.3
    assert np.linalg.eigvalsh(both / np.outer(sizes, sizes)).min() > 0.0


def test_camera_modes_of_other_samples_are_refused(estimates) -> None:
    _, found = estimates[0]
    asked = found.unknowns.moved({MODES: np.zeros(7)})
    with pytest.raises(ValueError, match="camera modes: value"):
        fit(found.swings, asked, BesideModes())
    with pytest.raises(ValueError, match="these swings have none"):
        fit(replace(found.swings, motions=()), found.unknowns, BesideModes())
    with pytest.raises(ValueError, match="called 'camera modes'"):
        fit(found.swings, found.unknowns, ONWARD)


def test_a_fit_goes_on_from_its_own_camera_modes(estimates) -> None:
    _, found = estimates[0]
    again = fit(found.swings, found.unknowns, BesideModes())
    moved = (again.value(MODES) - found.value(MODES)) / found.std(MODES)
    assert np.abs(moved).max() < 0.05, moved


@pytest.mark.slow
def test_held_out_runs_are_predicted_without_the_errors_found() -> None:
    """A tilted, wrongly scaled base frame: down to the noise (2.4 % by chance); not as recorded."""
    amplitudes = np.array([0.0, 0.0, 0.0, 3.0, 3.0, 3.0, 3.0])
    held = replace(runs(amplitudes, seed=9)[1], name="held", role="validate")
    found = identify([*runs(amplitudes, seed=6), held], paper_model().robot)
    inertia = found.estimates["ml_full"].values
    recorded_m = predict(paper_model(), prepared([held])[0], None, inertia).rmse_m
    freed_m = found.validation[0].prediction_rmse_m
    assert found.best == "ml_full", found.best
    assert recorded_m is not None, "not predicted as recorded"
    assert freed_m is not None, found.validation[0].note
    assert recorded_m > 1.5 * NOISE_M, f"as recorded: {1e3 * recorded_m:.4f} mm"
    assert freed_m < 1.08 * NOISE_M, f"freed: {1e3 * freed_m:.4f} mm"


def test_a_run_freed_of_its_true_errors_is_the_one_before_them() -> None:
    """Also where samples are missing, which stay so and harm no others."""
    amplitudes = np.random.default_rng(3).standard_normal(7)
    plain, off = (runs(a, seed=4, duration_s=1.0)[0] for a in (np.zeros(7), amplitudes))
    values = off.trajectory.values.copy()
    values[40:43] = np.nan
    gapped = replace(off, trajectory=replace(off.trajectory, values=values))
    left = freed(gapped, amplitudes).trajectory.values - plain.trajectory.values
    assert (np.isnan(left).all(axis=1) == np.isin(np.arange(len(left)), (40, 41, 42))).all(), left
    assert np.nanmax(np.abs(left)) < 1e-7, f"{np.nanmax(np.abs(left)):.2g} m or rad are left"


def test_held_out_runs_of_another_tracking_are_refused() -> None:
    run = runs(np.zeros(7), seed=4, duration_s=1.0)[0]
    with pytest.raises(ValueError, match="7 calibration errors, 5 in the fitted runs"):
        freed(run, np.zeros(5))


@pytest.mark.parametrize("full", [True, False])
def test_fidim_claims_what_the_calibration_does_to_it(full: bool) -> None:
    """Noise-free swings of a calibration 1 std off: the change is within the share's ellipsoid."""
    generator = np.random.default_rng(11)
    amplitudes = generator.standard_normal(7)
    plain, off = (prepared(runs(a, seed=1)) for a in (np.zeros(7), amplitudes))
    stacks = [
        Stack(
            [regressor(paper_model(), motion_of(run, full)) for run in one], np.ones(9, dtype=bool)
        )
        for one in (plain, off)
    ]
    change = (stacks[1].values - stacks[0].values)[:9]
    share = calibration_share(paper_model(), plain, full, stacks[0])
    assert share is not None
    z = change / np.sqrt(np.diag(share.covariance))
    assert 0.1 < np.abs(z).max() < 4.0, f"z = {np.round(z, 2)}"
