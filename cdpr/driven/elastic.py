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

from freeswing.cdpr.compiled.native import native
from freeswing.cdpr.driven.equations import rotation_of
from freeswing.cdpr.driven.kernels.elastic_kernels import ElasticMachine, elastic_samples
from freeswing.cdpr.driven.model import N_STATE, DrivenModel, function
from freeswing.cdpr.driven.motion import (
    LARGEST_REACH,
    MOST_DECAY,
    DrivenMotion,
    memory_for,
    pace_of,
    substeps_for,
)
from freeswing.cdpr.driven.scene import scene
from freeswing.cdpr.driven.slopes import moved
from freeswing.cdpr.driven.statics import static_pose
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.ldl_factors import Factors

Array = NDArray[np.float64]
Function = Any

# RK4 follows a cable's own oscillation of this many radians a step to 1e-4 of its size a cycle.
MOST_TURN = 0.4
MOST_SUBSTEPS = 200


@dataclass(frozen=True, slots=True)
class Stretch:
    """How cables give way.

    Attributes:
        stiffness_EA_N: axial stiffness EA.
        relaxation_s: damping over stiffness (Kelvin and Voigt).
    """

    stiffness_EA_N: float
    relaxation_s: float = 0.0


def elastic_rest(
    model: DrivenModel, currents: Array, stretch: Stretch, theta: Array | None = None
) -> Array:
    """Pose (7,) at rest under held currents, all cables taut.

    Raises:
        ValueError: when a cable is slack there or the search does not settle.

    Source:
        Press et al. 2007, Numerical Recipes, sec. 9.6: Newton's method in several
        dimensions, on INCA 2016, eqs. (8), (9) at rest.
    """
    theta = model.declared if theta is None else theta
    pose, force = static_pose(model, currents, theta).pose, np.full(6, np.inf)
    for _ in range(50):
        force = _pull_at_rest(model, pose, currents, stretch, theta)
        if np.abs(force).max() < 1e-11:
            return pose
        columns = []
        for k in range(6):
            shift = 1e-6 * np.eye(6)[k]
            ends = [
                _pull_at_rest(model, moved(pose, s * shift), currents, stretch, theta)
                for s in (1.0, -1.0)
            ]
            columns.append((ends[0] - ends[1]) / 2e-6)
        pose = moved(pose, -np.linalg.solve(np.array(columns).T, force))
    raise ValueError(f"no rest found: {np.abs(force).max():.2g} N are left at {pose.round(4)}")


def out_at_rest(
    model: DrivenModel, poses: Array, currents: Array, stretch: Stretch, theta: Array
) -> Array:
    """Lengths let out where every motor balances its cable, (..., n), for poses (..., 7).

    Source:
        INCA 2016, eq. (9) at rest with a linear cable: a quadratic, Press et al. 2007,
        Numerical Recipes, sec. 5.6.
    """
    lengths = evaluate(model.lengths, poses, theta)[0]
    spring, constant = evaluate(_held(model), currents, theta)
    # EA (L - l) / l = spring l + constant: the positive root.
    half, stiffness = 0.5 * (constant + stretch.stiffness_EA_N), stretch.stiffness_EA_N
    return stiffness * lengths / (half + np.sqrt(half**2 + spring * stiffness * lengths))


def _pull_at_rest(
    model: DrivenModel, pose: Array, currents: Array, stretch: Stretch, theta: Array
) -> Array:
    """Wrench on the platform (6,) with every motor at rest."""
    out = out_at_rest(model, pose, currents, stretch, theta)
    spring, constant = evaluate(_held(model), currents, theta)
    tensions = spring * out + constant
    if tensions.min() <= 0.0:
        raise ValueError(f"cable {int(np.argmin(tensions)) + 1} is slack at rest")
    state = np.concatenate([pose, np.zeros(6)])
    rows = evaluate(_rows(model), pose, theta)[0]
    return evaluate(_weight(model), state, theta)[0] - rows.T @ tensions


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
def _elastic_motion(model: DrivenModel) -> Function:
    """(state, out, rates, currents, EA, relaxation, theta) -> accelerations, tensions."""
    given, n = model.premises, model.n_cables
    motors = given.terms.motors
    sizes = {"state": N_STATE, "out": n, "rates": n, "currents": n}
    s = {name: ca.SX.sym(name, size) for name, size in sizes.items()}
    stiffness, relaxation = ca.SX.sym("scalar_EA"), ca.SX.sym("scalar_relaxation")
    state, out = s["state"], s["out"]
    turn = rotation_of(state[3:7])
    now = scene(given, state[:3], turn, state[7:], ca.SX.zeros(n))
    lengthening = ca.vertcat(*[one.rate for one in now.lines])
    strain = (now.lengths - out) / out
    straining = (lengthening - s["rates"] * (1 + strain)) / out
    tensions = ca.fmax(stiffness * (strain + relaxation * straining), 0)
    unwinding = s["rates"] / motors.drum_radius
    sign = ca.tanh(unwinding / motors.coulomb_width)
    torque = (
        motors.drum_radius * tensions / (1 + motors.roll * sign)
        - motors.spring * out / motors.drum_radius
        - motors.torque_constant * s["currents"]
        - motors.viscous * unwinding
        - motors.coulomb * sign
    )
    effort = now.outer - now.body.gyration(turn, state[10:]) - now.rows.T @ tensions
    outputs = {
        "acceleration": Factors.of(now.body.matrix(turn)).solved(effort),
        "letting": motors.drum_radius * torque / motors.inertia,
        "tensions": tensions,
    }
    constants = {"scalar_EA": stiffness, "scalar_relaxation": relaxation, "theta": given.theta}
    return function("elastic_motion", {**s, **constants}, outputs)


def simulate_elastic(
    model: DrivenModel,
    state: Array,
    references_A: Array,
    rate_hz: float,
    stretch: Stretch,
    theta: Array | None = None,
    *,
    currents_A: Array | None = None,
) -> DrivenMotion:
    """The motion of elastic cables, slack ones included; motors begin in balance with currents.

    Args:
        model: the equations.
        state: at the first sample, (13,).
        references_A: held from each row to the next, (n_t, n).
        rate_hz: samples a second.
        stretch: of the cables.
        theta: the model's numbers; None as declared.
        currents_A: what flows at the start, (n,); None: the first references.

    Raises:
        ValueError: for a stiffness that is not positive, or so large that `MOST_SUBSTEPS` steps a
            sample do not follow it: the rigid model is the limit then; and when the platform
            leaves its frame for good.
    """
    theta = model.declared if theta is None else theta
    if not stretch.stiffness_EA_N > 0.0:
        raise ValueError(f"stiffness EA is {stretch.stiffness_EA_N} N, must be > 0")
    references = np.array(references_A, dtype=np.float64, order="C")
    n_t, n = references.shape
    first = references[0] if currents_A is None else np.asarray(currents_A, dtype=np.float64)
    count = _substeps(model, state[:7], stretch, rate_hz, theta)
    looks = np.zeros((n_t, N_STATE + 2 * n))
    looks[0, :N_STATE] = state
    looks[0, N_STATE : N_STATE + n] = out_at_rest(model, state[:7], first, stretch, theta)
    looks[0, N_STATE + n :] = evaluate(_rows(model), state[:7], theta)[0] @ state[7:]
    currents, tensions = np.empty_like(references), np.empty_like(references)
    currents[0] = first
    pace = pace_of(model, theta, 1.0 / rate_hz, count)
    machine = _machine(model, stretch, theta)
    lost = elastic_samples(
        machine, pace.period, count, pace.reach, looks, currents, references, tensions
    )
    if lost >= 0:
        raise ValueError(
            f"at {lost / rate_hz:.3f} s the platform is more than {LARGEST_REACH:g} frames away: "
            "the currents pull it out; take smaller ones"
        )
    return DrivenMotion(
        model,
        theta,
        np.arange(n_t) / rate_hz,
        looks[:, :N_STATE].copy(),
        currents,
        references,
        tensions,
        np.full(n_t - 1, count),
        looks[:, N_STATE : N_STATE + n].copy(),
    )


def _machine(model: DrivenModel, stretch: Stretch, theta: Array) -> ElasticMachine:
    code, n = native(_elastic_motion(model)), model.n_cables
    size = N_STATE + 2 * n
    inputs = np.zeros(code.n_in)
    inputs[size + n], inputs[size + n + 1] = stretch.stiffness_EA_N, stretch.relaxation_s
    inputs[size + n + 2 :] = theta
    return ElasticMachine(*memory_for(code, inputs, evaluate(model.lags, theta)[0], size))


def _substeps(
    model: DrivenModel, pose: Array, stretch: Stretch, rate_hz: float, theta: Array
) -> int:
    """Steps a sample for the fastest oscillation of cables against motors and platform."""
    state, unit, stiffness = np.concatenate([pose, np.zeros(6)]), np.eye(6), stretch.stiffness_EA_N
    lengths = evaluate(model.lengths, pose, theta)[0]
    rows = evaluate(_rows(model), pose, theta)[0]
    still = evaluate(model.needed, state, np.zeros(6), theta)[0]
    whole = np.array([evaluate(model.needed, state, one, theta)[0] - still for one in unit])
    inertia = np.array([theta[k] for k in _motor_places(model)])
    reflected = inertia / evaluate(model.drums, theta)[0] ** 2
    body = whole - rows.T @ (reflected[:, None] * rows)
    apart = rows @ np.linalg.solve(body, rows.T) + np.diag(1.0 / reflected)
    fastest = np.sqrt(float(np.linalg.eigvals(apart * (stiffness / lengths)).real.max()))
    damped = fastest**2 * stretch.relaxation_s
    count = max(
        substeps_for(model, 1.0 / rate_hz, theta),
        int(np.ceil(fastest / (rate_hz * MOST_TURN))),
        int(np.ceil(damped / (rate_hz * MOST_DECAY))),
    )
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
