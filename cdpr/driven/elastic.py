"""The driven robot with elastic cables: slack is exact, each cable by itself.

Beside the platform every motor has a state of its own: the length of cable that it has let out,
unstretched. A cable pulls with EA times its strain, or not at all.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.equations import quaternion_rate, rotation_of
from freeswing.cdpr.driven.model import N_STATE, DrivenModel, function
from freeswing.cdpr.driven.scene import scene
from freeswing.cdpr.driven.slopes import moved
from freeswing.cdpr.driven.statics import static_pose
from freeswing.cdpr.model.batch import Bound, evaluate
from freeswing.cdpr.model.factors import Factors

Array = NDArray[np.float64]
Function = Any

# RK4 follows a cable's own oscillation of this many radians a step to 1e-4 of its size a cycle.
MOST_TURN = 0.4
MOST_SUBSTEPS = 200


@dataclass(frozen=True, slots=True)
class ElasticMotion:
    """A simulated motion at the sample times.

    Attributes:
        model: the robot.
        theta: its numbers.
        times_s: (n_t,).
        states: as of the rigid model, (n_t, 13).
        lengths_out_m: unstretched cable let out, (n_t, n).
        currents_A: (n_t, n).
        references_A: held from each sample to the next, (n_t, n).
        tensions_N: never negative, (n_t, n).
        substeps: integration steps a sample.
    """

    model: DrivenModel
    theta: Array
    times_s: Array
    states: Array
    lengths_out_m: Array
    currents_A: Array
    references_A: Array
    tensions_N: Array
    substeps: int

    def angles_rad(self, zero_pose: Array) -> Array:
        """Motor angles, zero where cables to this pose would be let out unstretched, (n_t, n)."""
        zero = evaluate(self.model.lengths, zero_pose, self.theta)[0]
        return (zero - self.lengths_out_m) / evaluate(self.model.drums, self.theta)[0]

    @property
    def slack(self) -> NDArray[np.bool_]:
        """Where a cable does not pull, (n_t, n)."""
        return self.tensions_N <= 0.0


def elastic_rest(
    model: DrivenModel, currents: Array, stiffness_EA_N: float, theta: Array | None = None
) -> tuple[Array, Array]:
    """Pose (7,) and lengths let out (n,) at rest under held currents, all cables taut.

    Raises:
        ValueError: when a cable is slack there or the search does not settle.
    """
    theta = model.declared if theta is None else theta
    pose, force = static_pose(model, currents, theta).pose, np.full(6, np.inf)
    for _ in range(50):
        force, out = _pull_at_rest(model, pose, currents, stiffness_EA_N, theta)
        if np.abs(force).max() < 1e-11:
            return pose, out
        columns = []
        for k in range(6):
            shift = 1e-6 * np.eye(6)[k]
            ends = [
                _pull_at_rest(model, moved(pose, s * shift), currents, stiffness_EA_N, theta)[0]
                for s in (1.0, -1.0)
            ]
            columns.append((ends[0] - ends[1]) / 2e-6)
        pose = moved(pose, -np.linalg.solve(np.array(columns).T, force))
    raise ValueError(f"no rest found: {np.abs(force).max():.2g} N are left at {pose.round(4)}")


def _pull_at_rest(
    model: DrivenModel, pose: Array, currents: Array, stiffness: float, theta: Array
) -> tuple[Array, Array]:
    """Wrench on the platform (6,) with every motor at rest, and the lengths let out (n,)."""
    lengths = evaluate(model.lengths, pose, theta)[0]
    spring, constant = evaluate(_held(model), currents, theta)
    # EA (L - l) / l = spring l + constant: the positive root.
    half = 0.5 * (constant + stiffness)
    out = (
        2.0
        * stiffness
        * lengths
        / (2.0 * half + 2.0 * np.sqrt(half**2 + spring * stiffness * lengths))
    )
    tensions = spring * out + constant
    if tensions.min() <= 0.0:
        raise ValueError(f"cable {int(np.argmin(tensions)) + 1} is slack at rest")
    state = np.concatenate([pose, np.zeros(6)])
    rows = evaluate(_rows(model), pose, theta)[0]
    weight = evaluate(_weight(model), state, theta)[0]
    return weight - rows.T @ tensions, out


@lru_cache(maxsize=8)
def _held(model: DrivenModel) -> Function:
    """(currents, theta) -> tension a metre let out, and without any, of a motor at rest."""
    given, currents = model.premises, ca.SX.sym("currents", model.n_cables)
    motors = given.terms.motors
    outputs = {
        "spring": motors.spring / motors.drum_radius**2,
        "constant": motors.torque_constant * currents / motors.drum_radius,
    }
    return function("held", {"currents": currents, "theta": given.theta}, outputs)


@lru_cache(maxsize=8)
def _rows(model: DrivenModel) -> Function:
    given, pose = model.premises, ca.SX.sym("pose", 7)
    zeros, still = ca.SX.zeros(6), ca.SX.zeros(model.n_cables)
    now = scene(given, pose[:3], rotation_of(pose[3:]), zeros, still)
    return function("rows", {"pose": pose, "theta": given.theta}, {"matrix_rows": now.rows})


@lru_cache(maxsize=8)
def _weight(model: DrivenModel) -> Function:
    given, state = model.premises, ca.SX.sym("state", N_STATE)
    still = ca.SX.zeros(model.n_cables)
    now = scene(given, state[:3], rotation_of(state[3:7]), state[7:], still)
    return function("weight", {"state": state, "theta": given.theta}, {"weight": now.outer})


@lru_cache(maxsize=8)
def _step(model: DrivenModel) -> Function:
    """(state, out, rates, currents, references, period, EA, theta) -> all of them afterwards."""
    given, n = model.premises, model.n_cables
    motors = given.terms.motors
    names = {"state": N_STATE, "out": n, "rates": n, "currents": n, "references": n}
    s = {name: ca.SX.sym(name, size) for name, size in names.items()}
    period, stiffness = ca.SX.sym("scalar_period"), ca.SX.sym("scalar_EA")

    def slope(y: Any, fraction: float) -> tuple[Any, Any]:
        state, out, rates = y[:N_STATE], y[N_STATE : N_STATE + n], y[N_STATE + n :]
        turn = rotation_of(state[3:7])
        now = scene(given, state[:3], turn, state[7:], ca.SX.zeros(n))
        tensions = ca.fmax(stiffness * (now.lengths - out) / out, 0)
        gap = s["currents"] - s["references"]
        flows = s["references"] + gap * ca.exp(-fraction * period / motors.time_constant)
        unwinding = rates / motors.drum_radius
        torque = (
            motors.drum_radius * tensions
            - motors.spring * out / motors.drum_radius
            - motors.torque_constant * flows
            - motors.viscous * unwinding
            - motors.coulomb * ca.tanh(unwinding / motors.coulomb_width)
        )
        effort = now.outer - now.body.gyration(turn, state[10:]) - now.rows.T @ tensions
        twist_rate = Factors.of(now.body.matrix(turn)).solved(effort)
        pose_rate = ca.vertcat(state[7:10], quaternion_rate(state[3:7], state[10:]))
        return ca.vertcat(
            pose_rate, twist_rate, rates, motors.drum_radius * torque / motors.inertia
        ), tensions

    y = ca.vertcat(s["state"], s["out"], s["rates"])
    first, tensions = slope(y, 0.0)
    second = slope(y + period / 2 * first, 0.5)[0]
    third = slope(y + period / 2 * second, 0.5)[0]
    fourth = slope(y + period * third, 1.0)[0]
    y = y + period / 6 * (first + 2 * second + 2 * third + fourth)
    quaternion = y[3:7] / ca.norm_2(y[3:7])
    left = ca.exp(-period / motors.time_constant)
    outputs = {
        "state_after": ca.vertcat(y[:3], quaternion, y[7:N_STATE]),
        "out_after": y[N_STATE : N_STATE + n],
        "rates_after": y[N_STATE + n :],
        "currents_after": s["references"] + (s["currents"] - s["references"]) * left,
        "tensions": tensions,
    }
    inputs = {**s, "scalar_period": period, "scalar_EA": stiffness, "theta": given.theta}
    return function("elastic_step", inputs, outputs)


def simulate_elastic(
    model: DrivenModel,
    pose: Array,
    lengths_out_m: Array,
    references_A: Array,
    rate_hz: float,
    stiffness_EA_N: float,
    theta: Array | None = None,
    currents_A: Array | None = None,
) -> ElasticMotion:
    """The motion from rest at a pose with given lengths let out, see `elastic_rest`.

    Raises:
        ValueError: for a stiffness that is not positive, or so large that `MOST_SUBSTEPS` steps a
            sample do not follow it: the rigid model is the limit then.
    """
    theta = model.declared if theta is None else theta
    if not stiffness_EA_N > 0.0:
        raise ValueError(f"stiffness EA is {stiffness_EA_N} N, must be > 0")
    count = _substeps(model, pose, stiffness_EA_N, rate_hz, theta)
    references = np.asarray(references_A, dtype=np.float64)
    n_t, n = references.shape
    step = Bound(_step(model), 1)
    step.inputs[5][:], step.inputs[6][:], step.inputs[7][:] = (
        1.0 / (rate_hz * count),
        stiffness_EA_N,
        theta,
    )
    first = references[0] if currents_A is None else currents_A
    now = [np.concatenate([pose, np.zeros(6)]), lengths_out_m, np.zeros(n), first]
    states, outs, currents, tensions = (np.empty((n_t, k)) for k in (N_STATE, n, n, n))
    for row in range(n_t):
        states[row], outs[row], currents[row] = now[0], now[1], now[3]
        for sub in range(count):
            for place, value in enumerate(now):
                step.inputs[place][0] = value
            step.inputs[4][0] = references[row]
            step.run()
            if sub == 0:
                tensions[row] = step.outputs[4][0]
            now = [step.outputs[k][0].copy() for k in range(4)]
    times = np.arange(n_t) / rate_hz
    return ElasticMotion(model, theta, times, states, outs, currents, references, tensions, count)


def _substeps(
    model: DrivenModel, pose: Array, stiffness: float, rate_hz: float, theta: Array
) -> int:
    """Steps a sample for the fastest oscillation of cables against motors and platform."""
    state, unit = np.concatenate([pose, np.zeros(6)]), np.eye(6)
    lengths = evaluate(model.lengths, pose, theta)[0]
    rows = evaluate(_rows(model), pose, theta)[0]
    still = evaluate(model.needed, state, np.zeros(6), theta)[0]
    whole = np.array([evaluate(model.needed, state, one, theta)[0] - still for one in unit])
    reflected = (
        np.array([theta[k] for k in _motor_places(model)]) / evaluate(model.drums, theta)[0] ** 2
    )
    body = whole - rows.T @ (reflected[:, None] * rows)
    apart = rows @ np.linalg.solve(body, rows.T) + np.diag(1.0 / reflected)
    fastest = np.sqrt(float(np.linalg.eigvals(apart * (stiffness / lengths)).real.max()))
    count = max(1, int(np.ceil(fastest / (rate_hz * MOST_TURN))))
    if count > MOST_SUBSTEPS:
        raise ValueError(
            f"cables of EA {stiffness:g} N swing at {fastest:.3g} rad/s: {count} steps a sample, "
            f"more than {MOST_SUBSTEPS}; leave the elasticity out"
        )
    return count


def _motor_places(model: DrivenModel) -> list[int]:
    """Where each motor's inertia stands in theta."""
    key = "motor_inertia_kg_m2"
    names = [f"{key}.{cable.name}" for cable in model.robot.cables]
    return [model.index(name if name in model.names else key) for name in names]
