"""A start from the encoders alone: direct kinematics, zero-phase derivatives, one regression."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.equations import rotation_of
from freeswing.cdpr.driven.model import N_STATE, DrivenModel, function
from freeswing.cdpr.driven.scene import scene
from freeswing.cdpr.driven.slopes import turn_map
from freeswing.cdpr.model.batch import evaluate
from freeswing.ident.drive.direct_kinematics import poses_from_turns
from freeswing.ident.drive.run_problem import DriveRun, given_A
from freeswing.ident.drive.unknowns import Asked

Array = NDArray[np.float64]

# Standard deviations of two Gaussians. The first gives derivatives, and is narrow so that a motor's
# friction turns round when the motor does; the second then smooths both sides of the equations
# alike, which takes the counts' noise (1.5 mrad) out without favouring either.
NARROW_S = 0.004
WIDE_S = 0.008
REACH = 4.0  # standard deviations; beyond them a Gaussian's weights are below 3e-4


@dataclass(frozen=True, slots=True)
class Regression:
    """Least squares of the wrench that the currents give.

    Attributes:
        values: of the dynamic unknowns, (k,).
        std: (k,), as if residuals were white.
        condition: of the regressor with columns of length 1.
    """

    values: Array
    std: Array
    condition: float


def inverse_dynamics(
    model: DrivenModel, theta: Array, asked: Asked, runs: list[DriveRun], zero: Array
) -> Regression:
    """Dynamic unknowns from angles and references, linear as the equations are in them.

    Args:
        model: the equations.
        theta: numbers with the estimated geometry.
        asked: dynamic unknowns.
        runs: those to identify from.
        zero: L / r where the angles are zero, (n,).
    """
    blocks = [_rows(model, theta, asked, run, zero) for run in runs]
    matrix = np.concatenate([block[0] for block in blocks])
    right = np.concatenate([block[1] for block in blocks])
    a, b, lengths, values = _weighted(matrix, right, np.ones(6))
    for _ in range(2):  # the second round weighs forces and moments by what they leave
        left = right - matrix @ values
        weight = 1.0 / np.sqrt(np.mean(left**2, axis=0) + 1e-30)
        a, b, lengths, values = _weighted(matrix, right, weight)
    scaled = a / lengths
    inverse = np.linalg.pinv(scaled.T @ scaled) / np.outer(lengths, lengths)
    variance = np.mean((b - a @ values) ** 2)
    condition = float(np.linalg.cond(scaled))
    return Regression(values, np.sqrt(variance * np.diag(inverse)), condition)


def _weighted(matrix: Array, right: Array, weight: Array) -> tuple[Array, Array, Array, Array]:
    """Rows a (m, k) and right side b (m,) weighted, the columns' lengths (k,) and the solution."""
    a = (matrix * weight[:, None]).reshape(-1, matrix.shape[-1])
    b = (right * weight).reshape(-1)
    lengths = np.linalg.norm(a, axis=0)
    lengths = np.where(lengths > 0.0, lengths, 1.0)
    return a, b, lengths, np.linalg.lstsq(a / lengths, b, rcond=None)[0] / lengths


def _rows(
    model: DrivenModel, theta: Array, asked: Asked, run: DriveRun, zero: Array
) -> tuple[Array, Array]:
    """Regressor (n_t, 6, k) and wrench less what is known (n_t, 6)."""
    turns = zero - run.record.angles_rad
    middle = run.record.poses[run.record.seen[0]] if len(run.record.seen) else np.eye(7)[3]
    poses, _ = poses_from_turns(model, theta, turns, middle)
    state, acceleration, inner = _derivatives(poses, run.rate_hz)
    currents = flowing(model, theta, run)
    gains = evaluate(model.wrench_matrix, state[:, :7], theta)[0]
    wrench = np.einsum("tij,tj->ti", gains, _smooth(currents, run.rate_hz)[0])
    known, regressor = evaluate(_regressor(model, asked.members), state, acceleration, theta)
    columns = np.concatenate([regressor @ asked.spread, (wrench - known)[..., None]], axis=-1)
    even = _smooth(columns.reshape(len(columns), -1), run.rate_hz, WIDE_S)[0]
    even = even.reshape(columns.shape)[inner]
    return even[..., :-1], even[..., -1]


def flowing(model: DrivenModel, theta: Array, run: DriveRun) -> Array:
    """Currents at every sample: the loop's lag on held references from what flowed first.

    Source:
        INCA 2016, sec. 4.2.1: the current loop as a first-order lag, exact for held
        references: Franklin, Powell, Workman 1998, Digital Control of Dynamic Systems, ch.
        4.
    """
    lag = [name for name in model.names if name.partition(".")[0] == "current_time_constant_s"]
    taus = np.array([theta[model.index(lag[0])]] * model.n_cables)
    for name in lag:
        own = name.partition(".")[2]
        for k, cable in enumerate(model.robot.cables):
            if cable.name == own:
                taus[k] = theta[model.index(name)]
    left = np.exp(-1.0 / (run.rate_hz * taus))
    references = given_A(model, run)
    result = np.empty_like(references)
    result[0] = run.record.currents_A[0]
    for k, reference in enumerate(references[:-1]):
        result[k + 1] = reference + (result[k] - reference) * left
    return result


def _smooth(values: Array, rate_hz: float, width_s: float = NARROW_S) -> tuple[Array, Array, Array]:
    """Values, first and second derivatives under a Gaussian about each sample."""
    half = round(REACH * width_s * rate_hz)
    t = np.arange(-half, half + 1) / rate_hz
    weights = np.exp(-0.5 * (t / width_s) ** 2)
    weights /= weights.sum()
    first = t / width_s**2 * weights
    first /= t @ first  # a line keeps its slope, a parabola its curvature
    second = (t**2 / width_s**4 - 1.0 / width_s**2) * weights
    second -= second.mean()
    second /= 0.5 * (t**2 @ second)
    padded = np.pad(values, ((half, half), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1, axis=0)
    return windows @ weights, windows @ first, windows @ second


def _derivatives(poses: Array, rate_hz: float) -> tuple[Array, Array, slice]:
    """States (n_t, 13), accelerations of the twist (n_t, 6), and where the window is whole."""
    signs = np.cumprod(np.sign(np.sum(poses[1:, 3:] * poses[:-1, 3:], axis=1)))
    quaternions = poses[:, 3:] * np.concatenate([[1.0], signs])[:, None]
    value, once, twice = _smooth(np.hstack([poses[:, :3], quaternions]), rate_hz)
    q = value[:, 3:] / np.linalg.norm(value[:, 3:], axis=1, keepdims=True)
    to_turn = 4.0 * np.swapaxes(turn_map(q), -1, -2)
    omega = np.einsum("tij,tj->ti", to_turn, once[:, 3:])
    alpha = np.einsum("tij,tj->ti", to_turn, twice[:, 3:])  # q'' = q o alpha / 2 - |omega|^2 q / 4
    state = np.hstack([value[:, :3], q, once[:, :3], omega])
    half = round(REACH * (NARROW_S + WIDE_S) * rate_hz)
    return state, np.hstack([twice[:, :3], alpha]), slice(half, len(poses) - half)


@lru_cache(maxsize=8)
def _regressor(model: DrivenModel, members: tuple[str, ...]) -> Any:
    """(state, acceleration, theta) -> what (10)'s left side is without them, and by them."""
    given = model.premises
    state, acceleration = ca.SX.sym("state", N_STATE), ca.SX.sym("acceleration", 6)
    currents = ca.SX.zeros(model.n_cables)
    now = scene(given, state[:3], rotation_of(state[3:7]), state[7:], currents)
    needed = now.balanced.whole @ acceleration - now.balanced.effort
    chosen = ca.vertcat(*[given.theta[model.index(name)] for name in members])
    slope = ca.jacobian(needed, chosen)
    zero = ca.SX.zeros(len(members))
    outputs = {
        "known": ca.substitute(needed, chosen, zero),
        "matrix_by_members": ca.substitute(slope, chosen, zero),
    }
    inputs = {"state": state, "acceleration": acceleration, "theta": given.theta}
    return function("regressor", inputs, outputs)
