"""Frames of the runs in maximum likelihood: each run's own, as well known as its poses state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.measured.slow_errors import SlowErrors
from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.cdpr.rotation import angles_from_matrix, exp_rotation, matrix_from_angles
from freeswing.ident.identify import IdentifySettings, identify
from freeswing.ident.runs import SwingRun
from tests.ident.swings import TRUE_INERTIA, paper_model, recorded, swing

COVARIANCE = np.diag(np.array([2e-4, 2e-4, 2e-4, 1e-3, 1e-3, 1e-3]) ** 2)
SEEDS = (0,)
EQUILIBRIA = (3, 6, 8, 9)


def framed(run: SwingRun, rng: np.random.Generator) -> SwingRun:
    """The run as measured in a frame that sits elsewhere, and states how far it may."""
    shift, turn = np.split(np.linalg.cholesky(COVARIANCE) @ rng.standard_normal(6), 2)
    values = run.trajectory.values
    R = matrix_from_angles(values[:, 3:])
    moved = np.concatenate(
        [values[:, :3] + R @ shift, angles_from_matrix(R @ exp_rotation(turn))], axis=1
    )
    slow = SlowErrors(COVARIANCE, np.zeros((6, 6)), 0.0)
    return replace(run, lengths_m=None, trajectory=replace(run.trajectory, values=moved, slow=slow))


def errors(runs: list[SwingRun]) -> Array:
    """Of the inertia, and what is claimed of them, (2, 9)."""
    settings = IdentifySettings(predict=False)
    found = identify(runs, paper_model().robot, settings).estimates["ml_full"]
    return np.array([found.values - TRUE_INERTIA, found.std])


@pytest.fixture(scope="module")
def both() -> tuple[Array, Array]:
    """With stated frames, and with poses taken at their word, (seeds, 2, 9) each."""
    told, blind = [], []
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        runs = [
            framed(recorded(swing(k, duration_s=3.0), f"s{k}", rng, 2e-5, POSE_COORDINATES), rng)
            for k in EQUILIBRIA
        ]
        told.append(errors(runs))
        plain = [replace(r, trajectory=replace(r.trajectory, slow=None)) for r in runs]
        blind.append(errors(plain))
    return np.array(told), np.array(blind)


@pytest.mark.slow
def test_claimed_deviations_hold_where_frames_differ(both: tuple[Array, Array]) -> None:
    told, _ = both
    z = told[:, 0] / told[:, 1]
    size = float(np.sqrt(np.mean(z**2)))
    assert 0.3 < size < 1.5, f"{size} of the claimed deviations: {np.round(z, 1)}"
    assert np.abs(z).max() < 4.0, np.round(z, 1)


@pytest.mark.slow
def test_frames_that_are_unknowns_leave_smaller_errors(both: tuple[Array, Array]) -> None:
    told, blind = (np.sqrt(np.mean(one[:, 0] ** 2, axis=0)) for one in both)
    ratio = float(np.exp(np.mean(np.log(told / blind))))
    assert ratio < 0.6, f"errors {ratio} of those of poses taken at their word: {told / blind}"
