"""Rest poses and start states turn with the frames, whatever names the angles take."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from freeswing.cdpr.measured.trajectory import Trajectory, unwrapped
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.robot import Cable, Platform, Robot
from freeswing.cdpr.rotation import angles_from_matrix, exp_rotation, matrix_from_angles
from freeswing.ident.likelihood.guess_run_start import first_state
from freeswing.ident.likelihood.rest_pose import branches, named_like, rest_near
from freeswing.ident.likelihood.samples_and_noise import prepare
from freeswing.ident.runs import SwingRun

INERTIA = np.array([0.004, -0.002, -0.03, 0.011, 0.012, 0.017, 0.0, 0.0, 0.0])
LENGTHS = np.array([1.1, 1.1, 1.1])
RADIUS, TOP = 0.2, 0.3


def bench(turn_base: np.ndarray, turn_platform: np.ndarray) -> tuple[Robot, np.ndarray]:
    """Three leaning wires in turned frames, and the inertia in the turned platform's."""
    cables = []
    for k in range(3):
        angle = 2.0 * np.pi * k / 3.0 + 0.3
        ring = np.array([np.cos(angle), np.sin(angle), 0.0])
        entry = turn_base @ (TOP * ring + [0.1, -0.2, 1.0])
        cables.append(Cable(str(k), entry, 0.0, turn_platform.T @ (RADIUS * ring)))
    tensor = np.diag(INERTIA[3:6])
    turned = turn_platform.T @ tensor @ turn_platform
    com = turn_platform.T @ INERTIA[:3]
    entries = turned[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    platform = Platform(0.6, com, entries)
    gravity = turn_base @ np.array([0.0, 0.0, -9.81])
    return Robot("turned", tuple(cables), gravity, ("x", "y", "chi"), platform), np.append(
        com, entries
    )


angle = st.floats(-3.1, 3.1, allow_nan=False)


@settings(max_examples=4, deadline=None)
@given(st.tuples(angle, angle, angle), st.tuples(angle, angle, angle))
def test_the_rest_pose_turns_with_both_frames(base: tuple, platform: tuple) -> None:
    turn_base, turn_platform = exp_rotation(np.array(base)), exp_rotation(np.array(platform))
    plain, inertia = bench(np.eye(3), np.eye(3))
    rest = rest_near(build_model(plain), LENGTHS, inertia, (), np.zeros(0), "plain")
    turned, other = bench(turn_base, turn_platform)
    found = rest_near(build_model(turned), LENGTHS, other, (), np.zeros(0), "turned")
    expected = turn_base @ matrix_from_angles(rest.zeta[3:]) @ turn_platform
    np.testing.assert_allclose(matrix_from_angles(found.zeta[3:]), expected, atol=1e-9)
    np.testing.assert_allclose(found.zeta[:3], turn_base @ rest.zeta[:3], atol=1e-9)


HALF = {
    "phi": np.diag([1.0, -1.0, -1.0]),
    "theta": np.diag([-1.0, 1.0, -1.0]),
    "chi": np.diag([-1.0, -1.0, 1.0]),
}


@settings(max_examples=5, deadline=None)
@given(st.sampled_from(sorted(HALF)), angle, st.integers(-1, 1))
def test_free_coordinates_start_alike_in_any_branch(axis: str, yaw: float, turns: int) -> None:
    """Platform axes turned by a half turn about any axis, and by any yaw beside."""
    turn = exp_rotation(np.array([0.0, 0.0, yaw])) @ HALF[axis]
    plain, inertia = bench(np.eye(3), np.eye(3))
    turned, other = bench(np.eye(3), turn)
    times = np.linspace(0.0, 2.0, 200)
    model = build_model(plain)
    rest = rest_near(model, LENGTHS, inertia, (), np.zeros(0), "plain").zeta
    swing = rest + 0.03 * np.sin(np.outer(times, [3.1, 2.9, 0.0, 0.0, 0.0, 5.0]))
    states = []
    for robot, extra, body in ((plain, np.eye(3), inertia), (turned, turn, other)):
        rotations = matrix_from_angles(full_poses(model, swing)[:, 3:]) @ extra
        angles = unwrapped(angles_from_matrix(rotations))
        values = np.column_stack([swing[:, :2], angles[:, 2] + 2.0 * np.pi * turns])
        run = SwingRun("run", "identify", Trajectory(times, ("x", "y", "chi"), values), LENGTHS)
        state = first_state(build_model(robot), prepare(run, (0.0, 2.0)), body)
        states.append((state[:3], matrix_from_angles(state[3:6]) @ extra.T, state[6:9]))
    for mine, theirs in zip(*states, strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-9)


def full_poses(model: Model, swing: np.ndarray) -> np.ndarray:
    """The poses of x, y, chi on the wires."""
    from freeswing.cdpr.model.free_motion import assemble

    start = rest_near(model, LENGTHS, INERTIA, (), np.zeros(0), "plain").zeta
    path = np.vstack([np.linspace(start, swing[0], 30)[:-1], swing])[:, [0, 1, 5]]
    return assemble(model, ("x", "y", "chi"), LENGTHS, path, start).zetas[-len(swing) :]


def test_both_names_are_one_orientation_and_the_measured_one_is_taken() -> None:
    zeta = np.array([0.1, 0.2, 0.3, 0.4, -0.5, 1.2])
    one, other = branches(zeta)
    np.testing.assert_allclose(
        matrix_from_angles(one[3:]), matrix_from_angles(other[3:]), atol=1e-12
    )
    named = named_like(zeta, [5], np.array([1.2 + np.pi + 4.0 * np.pi]))
    assert named[5] == pytest.approx(1.2 + 5.0 * np.pi)
    np.testing.assert_allclose(
        matrix_from_angles(named[3:]), matrix_from_angles(zeta[3:]), atol=1e-12
    )


def test_no_rest_pose_names_the_run() -> None:
    robot, inertia = bench(np.eye(3), np.eye(3))
    with pytest.raises(ValueError, match=r"run short: no stable rest pose with taut wires"):
        rest_near(build_model(robot), np.array([0.1, 1.1, 3.0]), inertia, (), np.zeros(0), "short")
