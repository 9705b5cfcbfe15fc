"""Where maximum likelihood starts: possible bodies only, and the best coordinates first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdpr.model import build_model
from cdpr.robot import POSE_COORDINATES
from ident.prepare import prepare_runs
from ident.signals import SignalSettings
from ident.starts import is_possible, likelihood_starts
from tests.ident.swings import REGULAR, TRUE_INERTIA, paper_model, recorded, swing


def test_bodies_are_told_from_impossible_inertias():
    points = np.random.default_rng(0).normal(size=(20, 3))
    tensor = sum(p @ p * np.eye(3) - np.outer(p, p) for p in points) / 20
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
