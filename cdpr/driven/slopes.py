"""Exact derivatives of a driven robot's acceleration and lengths, by chosen numbers alone."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.equations import rotation_of
from freeswing.cdpr.driven.model import N_STATE, DrivenModel, function
from freeswing.cdpr.driven.scene import scene
from freeswing.cdpr.model.batch import evaluate

Array = NDArray[np.float64]
Function = Any
N_TANGENT = 12


@lru_cache(maxsize=32)
def motion_slope(model: DrivenModel, chosen: tuple[str, ...] = ()) -> Function:
    """(state, currents, theta) -> acceleration (6,), its derivatives by state (6, 13), by currents
    (6, n) and by the chosen names of theta (6, len(chosen)).

    The acceleration a solves M a = e: its derivative is M^-1 d(e - M a) with a held, which is half
    the work of differentiating the solution.

    Raises:
        ValueError: for a name that the model does not have.
    """  # noqa: D205
    given, n = model.premises, model.n_cables
    state, currents = ca.SX.sym("state", N_STATE), ca.SX.sym("currents", n)
    held = ca.SX.sym("held", 6)
    now = scene(given, state[:3], rotation_of(state[3:7]), state[7:], currents)
    columns = [given.theta[model.index(name)] for name in chosen]
    by = ca.vertcat(state, currents, *columns)
    rest = now.balanced.effort - now.balanced.whole @ held
    acceleration = now.balanced.solved(now.balanced.effort)
    slope = ca.substitute(ca.jacobian(rest, by), held, acceleration)
    solved = now.balanced.solved(slope)
    outputs = {
        "acceleration": acceleration,
        "matrix_by_state": solved[:, :N_STATE],
        "matrix_by_currents": solved[:, N_STATE : N_STATE + n],
    }
    if chosen:
        outputs["matrix_by_chosen"] = solved[:, N_STATE + n :]
    inputs = {"state": state, "currents": currents, "theta": given.theta}
    return function("motion_slope", inputs, outputs)


@lru_cache(maxsize=32)
def directed_slope(model: DrivenModel, chosen: tuple[str, ...] = ()) -> Function:
    """(state, currents, theta, direction 6) -> direction . (acceleration's derivatives).

    By state, currents and the chosen names of theta, one after another. The acceleration a solves
    M a = e, so that direction . da = (M^-1 direction) . d(e - M a) with a held: one sweep backwards
    through the equations instead of one forwards a column.

    Raises:
        ValueError: for a name that the model does not have.
    """
    given, n = model.premises, model.n_cables
    state, currents = ca.SX.sym("state", N_STATE), ca.SX.sym("currents", n)
    direction, held, lifted = (ca.SX.sym(name, 6) for name in ("direction", "held", "lifted"))
    now = scene(given, state[:3], rotation_of(state[3:7]), state[7:], currents)
    columns = [given.theta[model.index(name)] for name in chosen]
    by = ca.vertcat(state, currents, *columns)
    rest = now.balanced.effort - now.balanced.whole @ held
    slope = ca.gradient(ca.dot(lifted, rest), by)
    solved = now.balanced.solved(ca.horzcat(now.balanced.effort, direction))
    slope = ca.substitute(slope, ca.vertcat(held, lifted), ca.vec(solved))
    inputs = {"state": state, "currents": currents, "theta": given.theta, "direction": direction}
    return function("directed_slope", inputs, {"slope": slope})


@lru_cache(maxsize=32)
def length_slope(model: DrivenModel, chosen: tuple[str, ...] = ()) -> Function:
    """(pose 7, theta) -> lengths over drum radii (n,), by pose (n, 7), by the chosen (n, k)."""
    given = model.premises
    pose = ca.SX.sym("pose", 7)
    zeros = ca.SX.zeros(6)
    now = scene(given, pose[:3], rotation_of(pose[3:]), zeros, ca.SX.zeros(model.n_cables))
    turns = now.lengths / given.terms.motors.drum_radius
    outputs = {"turns": turns, "matrix_by_pose": ca.jacobian(turns, pose)}
    if chosen:
        columns = ca.vertcat(*[given.theta[model.index(name)] for name in chosen])
        outputs["matrix_by_chosen"] = ca.jacobian(turns, columns)
    return function("length_slope", {"pose": pose, "theta": given.theta}, outputs)


def turn_map(quaternions: Array) -> Array:
    """Change of a quaternion by a small turn in the platform frame: (..., 4) -> (..., 4, 3).

    Source:
        Sola 2017, Quaternion Kinematics for the Error-State Kalman Filter, sec. 4: local
        perturbations.
    """
    q = np.asarray(quaternions, dtype=np.float64)
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = [[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]]
    return 0.5 * np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def pose_map(poses: Array) -> Array:
    """Change of a pose (7,) by a small translation and turn, (..., 7) -> (..., 7, 6)."""
    poses = np.asarray(poses, dtype=np.float64)
    result = np.zeros((*poses.shape[:-1], 7, 6))
    result[..., :3, :3] = np.eye(3)
    result[..., 3:, 3:] = turn_map(poses[..., 3:])
    return result


def moved(poses: Array, shifts: NDArray[np.floating]) -> Array:
    """Poses (..., 7) after small translations and turns in the platform frame (..., 6).

    Source:
        Sola 2017, Quaternion Kinematics for the Error-State Kalman Filter, sec. 2.4 and 4.
    """
    poses, shifts = np.broadcast_arrays(poses, np.concatenate([shifts, shifts[..., :1]], axis=-1))
    angle = np.linalg.norm(shifts[..., 3:6], axis=-1, keepdims=True)
    half = 0.5 * np.sinc(angle / (2 * np.pi)) * shifts[..., 3:6]
    w, v = poses[..., 3:4], poses[..., 4:]
    c = np.cos(angle / 2)
    real = w * c - np.sum(v * half, axis=-1, keepdims=True)
    imaginary = w * half + c * v + np.cross(v, half)
    quaternion = np.concatenate([real, imaginary], axis=-1)
    quaternion = quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)
    return np.concatenate([poses[..., :3] + shifts[..., :3], quaternion], axis=-1)


def stiffness(
    model: DrivenModel, pose: Array, currents: Array, theta: Array
) -> tuple[Array, Array]:
    """Acceleration at rest (6,), and minus its derivative by translation and turn (6, 6).

    Source:
        INCA 2016, eqs. (14), (16), here by exact derivatives.
    """
    state = np.concatenate([pose, np.zeros(6)])
    acceleration, by_state = evaluate(motion_slope(model), state, currents, theta)[:2]
    return acceleration, -by_state[:, :7] @ pose_map(pose)
