"""Pose residuals: rotation vectors that turn with the frames, with exact slopes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.cdpr.rotation import angles_from_matrix, exp_rotation, matrix_from_angles
from freeswing.ident.likelihood.run_residuals import Samples, differences
from freeswing.ident.likelihood.samples_and_noise import prepare
from tests.ident.swings import recorded, tilted_swing


def poses() -> Samples:
    run = recorded(tilted_swing(5, duration_s=1.5), "r", None, 0.0, POSE_COORDINATES)
    return prepare(run, (0.0, 1.5))


def off_by(samples: Samples, turn: Array) -> Array:
    """Predictions whose orientation is off by a rotation of the base frame, (n, 6)."""
    rotations = exp_rotation(turn) @ matrix_from_angles(samples.values[:, 3:])
    return np.concatenate([samples.values[:, :3] + 0.01, angles_from_matrix(rotations)], axis=1)


def test_a_large_turn_is_told_to_its_last_digit() -> None:
    samples, turn = poses(), np.array([0.5, -0.9, 0.3])
    found = differences(off_by(samples, turn), samples)
    np.testing.assert_allclose(found[:, 3:], np.tile(turn, (len(found), 1)), atol=1e-13)
    np.testing.assert_allclose(found[:, :3], 0.01, atol=1e-14)


def test_whole_turns_of_an_angle_are_no_difference() -> None:
    samples = poses()
    again = replace(samples, values=samples.values + 2.0 * np.pi * (np.arange(6) == 5))
    assert np.abs(differences(samples.values, again)).max() < 1e-13
