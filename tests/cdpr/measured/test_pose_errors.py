"""Errors common to all poses: the terms they are made of, and their place in result files."""

from __future__ import annotations

import json

import numpy as np
import pytest

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.measured.pose_errors import (
    TERMS,
    PoseErrors,
    error_terms,
    fitted_terms,
    read_pose_errors,
)
from freeswing.cdpr.rotation import exp_rotation


def poses(count: int = 40, seed: int = 1):
    """Random positions, rotations and velocities of a platform about one place."""
    random = np.random.default_rng(seed)
    positions = [1.2, -0.3, 0.1] + 0.05 * random.standard_normal((count, 3))
    rotations = exp_rotation(0.1 * random.standard_normal((count, 3)))
    return positions, rotations, 0.3 * random.standard_normal((count, 6))


def test_a_moved_base_frame_is_one_mode() -> None:
    """A base frame turned by a small r and shifted by t moves poses by t + r x p, and r."""
    positions, rotations, velocities = poses()
    shift, turn, about = np.array([1e-4, -2e-4, 5e-5]), np.array([2e-4, 1e-4, -3e-4]), positions[0]
    mode = np.zeros((6, TERMS))
    mode[:3, 0] = shift + np.cross(turn, about)
    mode[:3, 1:4] = np.cross(turn, np.eye(3)).T
    mode[3:, 0] = turn
    errors = PoseErrors(about, np.eye(3), mode[None])
    moved = errors.at(positions, rotations, velocities)[..., 0]
    exact = np.concatenate([shift + np.cross(turn, positions), np.tile(turn, (40, 1))], axis=1)
    worst = np.abs(moved - exact).max()
    assert worst < 1e-15, f"off by {worst:.2g}"


def test_errors_linear_in_pose_and_velocity_are_fitted_exactly() -> None:
    positions, rotations, velocities = poses()
    about, turned = positions[3], rotations[3]
    modes = 1e-4 * np.random.default_rng(2).standard_normal((2, 6, TERMS))
    truth = PoseErrors(about, turned, modes)
    slopes = truth.at(positions, rotations, velocities)
    terms = error_terms(positions, rotations, velocities, about, turned)
    found = np.moveaxis(fitted_terms(terms, slopes), 2, 0)
    worst = np.abs(found - modes).max()
    assert worst < 1e-12, f"off by {worst:.2g}"


def test_the_document_reads_back_to_six_digits() -> None:
    positions, rotations, _ = poses()
    modes = 1e-5 * np.random.default_rng(3).standard_normal((3, 6, TERMS))
    errors = PoseErrors(positions[0], rotations[0], modes)
    again = read_pose_errors(json.loads(json.dumps(errors.document())))
    worst = np.abs(again.modes / modes - 1.0).max()
    assert worst < 1e-5, f"relative difference {worst:.2g}"
    assert np.allclose(again.about_rotation, rotations[0], atol=1e-12), again.about_rotation


@pytest.mark.parametrize(
    "document",
    [{}, [], {"modes": [[1.0]]}, {"modes": [], "about_q_wxyz": [1, 0, 0], "about_position_m": []}],
)
def test_another_document_is_refused(document: object) -> None:
    with pytest.raises(InputError, match="calibration_errors"):
        read_pose_errors(document)
