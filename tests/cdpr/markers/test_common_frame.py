"""What target.toml leaves open of the frame of all runs, and how much markers move between them."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.cdpr.markers.common_frame import common_frame
from freeswing.cdpr.markers.layout_of_session import session_layout
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.rotation import exp_rotation, log_rotation

COVARIANCE = np.diag(np.array([2e-4, 3e-4, 1e-4, 1e-3, 2e-3, 1.5e-3]) ** 2)
MOVED_M = 1e-4
PLACES_M = np.array(
    [[0, 0, 0], [-0.17, -0.15, 0.04], [0.19, -0.14, 0.05], [0.2, 0.14, 0.04], [-0.18, 0.15, 0.03]]
)
SEEDS = 12


def poses() -> tuple[np.ndarray, np.ndarray, Trajectory]:
    """A swing of a tenth of a radian about an orientation that is far from the base's."""
    times = np.linspace(0.0, 2.0, 60)
    turns = 0.1 * np.column_stack([np.sin(times), np.cos(2 * times), np.sin(3 * times)])
    R = exp_rotation(turns) @ exp_rotation(np.array([0.4, -0.3, 1.1]))
    t = np.column_stack([np.sin(times), times, 0.1 * times])
    return R, t, Trajectory.from_poses(times, t, R, None, "made")


def test_the_modes_are_what_a_frame_put_elsewhere_does_to_the_poses() -> None:
    R, t, trajectory = poses()
    errors = common_frame(COVARIANCE, trajectory)
    amplitudes = np.array([0.5, -1.0, 2.0, 1.0, 0.3, -0.7])
    told = errors.at(t, R, np.zeros((len(t), 6))) @ amplitudes
    shift, turn = np.split(np.linalg.cholesky(COVARIANCE) @ amplitudes, 2)
    moved = np.concatenate(
        [R @ shift, log_rotation(R @ exp_rotation(turn) @ np.swapaxes(R, 1, 2))], axis=1
    )
    off = np.abs(told - moved).max(axis=0)
    assert off == pytest.approx(0.0, abs=5e-5), f"{off} beside {np.abs(moved).max(axis=0)}"


def test_how_far_markers_move_from_run_to_run_is_told_whoever_is_hidden() -> None:
    """Medians of what robust alignments leave said 0.066 mm of 0.1."""
    told = []
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        layout = PLACES_M + 2e-4 * rng.normal(size=PLACES_M.shape)
        layout[rng.integers(1, 5)] += [1e-3, 8e-4, 8e-4]
        runs = []
        for run in range(8):
            places = layout + MOVED_M * rng.normal(size=layout.shape)
            if run % 2 == 0:
                places[rng.integers(5)] = np.nan
            turned = exp_rotation(rng.normal(size=3))
            runs.append(places @ turned.T + rng.normal(size=3))
        told.append(session_layout(PLACES_M, runs, 1e-6).run_std_m)
    assert np.mean(told) == pytest.approx(MOVED_M, rel=0.1), told
    assert np.std(told) < 0.2 * MOVED_M, told
