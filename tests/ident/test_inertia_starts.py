"""Where maximum likelihood starts: possible bodies only, and the best coordinates first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.ident.inertia_starts import likelihood_starts
from freeswing.ident.judge.physical_consistency import is_possible
from freeswing.ident.likelihood.guess_run_start import first_state
from freeswing.ident.likelihood.samples_and_noise import prepare
from freeswing.ident.signals.derivatives import SignalSettings
from freeswing.ident.signals.usable_runs import prepare_runs
from tests.ident.swings import REGULAR, TRUE_INERTIA, paper_model, recorded, swing


def test_bodies_are_told_from_impossible_inertias():
    points = np.random.default_rng(0).normal(size=(20, 3))
    tensor = np.mean([p @ p * np.eye(3) - np.outer(p, p) for p in points], axis=0)
    body = np.concatenate([points.mean(axis=0), tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])
    flat = body.copy()
    flat[3] = 0.5 * abs(flat[4] - flat[5])
    assert is_possible(body), f"{body}"
    assert is_possible(TRUE_INERTIA), f"{TRUE_INERTIA}"
    assert not is_possible(flat), "moments of inertia broke the triangle inequality unnoticed"


def test_poor_coordinates_do_not_spoil_the_start():
    """Declared x and z hardly settle the pose; poses do, so the start is good all the same."""
    robot = replace(paper_model().robot, free_coordinates=("x", "z"))
    generator = np.random.default_rng(1)
    runs = [
        recorded(swing(k, 0.02, 0.015), str(k), generator, 1e-5, POSE_COORDINATES) for k in REGULAR
    ]
    model = build_model(robot)
    starts = likelihood_starts(model, prepare_runs(runs, model, SignalSettings()), ())
    off = np.abs(starts[0] - TRUE_INERTIA)[2:6] / TRUE_INERTIA[2:6]
    assert (off < 0.02).all(), f"the first start is off by {100 * off} %"


def test_impossible_results_are_passed_over():
    model = paper_model()
    prepared = prepare_runs([recorded(swing(5), "r")], model, SignalSettings())
    bad = -TRUE_INERTIA
    starts = likelihood_starts(model, prepared, (bad,))
    assert all(is_possible(start) for start in starts), f"{starts}"


FAST = np.array([0.002, -0.0025, 0.198, 0.0647, 0.0513, 0.0377, 0.0, -4e-4, 5e-4])


@pytest.mark.parametrize("rate_hz", [100, 50])
def test_modes_that_turn_round_quickly_are_started_well(rate_hz: int):
    """A light platform swings at 3 Hz: a polynomial over 0.4 s was off by 1.5 rad/s."""
    motion = swing(11, duration_s=5.0, inertia=tuple(FAST))
    run = recorded(motion, "fast", np.random.default_rng(5), 1e-4)
    every = 100 // rate_hz
    values, times = run.trajectory.values[::every], run.trajectory.times_s[::every]
    run = replace(run, trajectory=Trajectory(times, ("x", "y"), values))
    state = first_state(paper_model(), prepare(run, (0.0, 5.0)), TRUE_INERTIA)
    off = np.abs(state - np.concatenate([motion.zetas[0], motion.rates[0]]))
    assert off[:6].max() < 0.02, f"pose off by {np.round(off[:6], 4)}"
    assert off[6:].max() < 0.5, f"rates off by {np.round(off[6:], 3)}"
