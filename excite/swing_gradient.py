"""Exact derivatives of a swing's W^T W and of its limits by the pose of release.

The regressor is the part of the generalised force of free motion that is linear in the inertia;
here it comes out of the model's energies by Lagrange's equations, so that it can be differentiated
(the closed form of eq. 19, in `cdpr.model.internal_dynamics`, is its test). The motion's own
derivatives are those of `cdpr.simulation.sensitivity`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from freeswing.cdpr.model.batch import evaluate, with_jacobian
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.statics import Equilibrium
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.free_swing import Motion
from freeswing.cdpr.simulation.sensitivity import linearise
from freeswing.excite.swing import Bench, Swing


@dataclass(frozen=True, slots=True)
class SwingSlopes:
    """First order of a swing in its pose of release.

    Attributes:
        gram: derivatives of W^T W, (10, 10, 6).
        excess: limits as numbers that must not be positive, each over its own size, (c,).
        excess_by: their derivatives, (c, 6).
    """

    gram: Array
    excess: Array
    excess_by: Array


class Differentiator:
    """Derivatives of swings on one bench; its functions are built once."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self._regressor = _directional_regressor(bench.model, tuple(bench.free_indices))

    def slopes(self, swing: Swing) -> SwingSlopes:
        """Simulate a swing again; how what it excites and its limits answer to its release.

        Raises:
            ValueError: when the motion cannot be followed.
        """
        bench = self.bench
        course = bench.course(swing.release, bench.duration_s)
        linear = linearise(course.motion)
        moves = _moves(bench, course.motion, linear, bench.times_s)
        flat = moves.swapaxes(1, 2).reshape(len(moves), -1)
        found = evaluate(self._regressor, *course.motion.at(bench.times_s), flat)
        stacked = found[0].reshape(len(moves), 10, -1)
        changes = found[1].reshape(len(moves), 6, 10, -1)
        half = np.einsum("tir,tkjr->ijk", stacked, changes, optimize=True)
        excess, excess_by = _limits(bench, swing, course, linear)
        return SwingSlopes(half + half.swapaxes(0, 1), excess, excess_by)


def lagrange_regressor(model: Model, free: tuple[int, ...]) -> Any:
    """CasADi function (zeta, rates, accelerations) -> W' (6 - n, 10) of eqs. (21), (22)."""
    names = ("zeta", "rates", "accelerations")
    zeta, rates, accelerations = (ca.SX.sym(name, 6) for name in names)
    inertia, values = ca.SX.sym("inertia", 9), ca.DM(model.start_values)
    kinetic, potential = model.energy(zeta, rates, inertia, values)
    momentum = ca.gradient(kinetic, rates)
    force = (
        ca.jtimes(momentum, zeta, rates)
        + ca.jtimes(momentum, rates, accelerations)
        - ca.gradient(kinetic - potential, zeta)
    )
    lengths_by = model.cables(zeta, values)[3]
    bound = [k for k in range(6) if k not in free]
    follow = -ca.inv(lengths_by[:, bound]) @ lengths_by[:, list(free)]
    carried = force[list(free)] + follow.T @ force[bound]
    rest = ca.substitute(carried, inertia, ca.SX.zeros(9))
    regressor = ca.horzcat(rest, ca.jacobian(carried, inertia))
    inputs = [zeta, rates, accelerations]
    return ca.Function("regressor", inputs, [ca.densify(regressor)], list(names), ["matrix"])


def _directional_regressor(model: Model, free: tuple[int, ...]) -> Any:
    """W' and its derivatives along six directions of [zeta; rates; accelerations], stacked."""
    plain = lagrange_regressor(model, free)
    states = [ca.SX.sym(name, 6) for name in ("zeta", "rates", "accelerations")]
    moves = ca.SX.sym("moves", 18 * 6)
    regressor = ca.vec(plain(*states))
    directions = ca.reshape(moves, 18, 6)
    changes = ca.jtimes(regressor, ca.vertcat(*states), directions)
    outputs = [regressor, ca.vec(ca.densify(changes))]
    names = ["zeta", "rates", "accelerations", "moves"]
    options = {"cse": True}
    return ca.Function("moved", [*states, moves], outputs, names, ["stacked", "changes"], options)


def _moves(bench: Bench, motion: Motion, linear: Any, times_s: Array) -> Array:
    """Derivatives of [zeta; rates; accelerations] by the pose of release, (t, 18, 6)."""
    zetas, rates, _ = motion.at(times_s)
    zetas_by, rates_by = (part[..., :6] for part in linear.at(times_s))
    function = with_jacobian(bench.model.acceleration, (1, 2))
    arguments = (times_s, zetas, rates, bench.inertia, bench.model.start_values)
    by_state = evaluate(function, *arguments)[1]
    seconds_by = by_state[..., :6] @ zetas_by + by_state[..., 6:] @ rates_by
    return np.concatenate([zetas_by, rates_by, seconds_by], axis=1)


def _limits(bench: Bench, swing: Swing, course: Any, linear: Any) -> tuple[Array, Array]:
    """Excess over tension and reach limits at the worst instant of each, and its derivatives."""
    low, high = bench.limits.tension_N
    free, rest = bench.free_indices, swing.equilibrium
    n, tensions = bench.model.robot.n_cables, course.tensions_N
    away = course.zetas[:, free] - rest.zeta[free]
    tightest, slackest = tensions.argmax(axis=0), tensions.argmin(axis=0)
    furthest = np.abs(away).argmax(axis=0)
    instants = np.concatenate([tightest, slackest, furthest])
    states = linear.at(course.times_s[instants])
    zetas_by, rates_by = (part[..., :6] for part in states)
    zetas, rates, _ = course.motion.at(course.times_s[instants])
    function = with_jacobian(bench.model.acceleration, (1, 2), 1)
    arguments = (0 * instants, zetas, rates, bench.inertia, bench.model.start_values)
    tension_by = bench.mass_kg * evaluate(function, *arguments)[1]
    moved = tension_by[..., :6] @ zetas_by + tension_by[..., 6:] @ rates_by
    cables, span = np.arange(n), high - low
    over = (tensions[tightest, cables] - high) / span
    under = (low - tensions[slackest, cables]) / span
    rest_by = equilibrium_by_release(bench, rest, swing.release)
    rows = np.arange(2 * n, len(instants))
    signs = np.sign(away[furthest, np.arange(len(free))])
    reach = bench.reach_limits
    out = np.abs(away[furthest, np.arange(len(free))]) / reach - 1
    out_by = (zetas_by[rows, free] - rest_by[free]) * (signs / reach)[:, None]
    by = [moved[cables, cables] / span, -moved[n + cables, cables] / span, out_by]
    return np.concatenate([over, under, out]), np.concatenate(by)


def equilibrium_by_release(bench: Bench, rest: Equilibrium, release: Array) -> Array:
    """Derivative of the equilibrium pose by the pose of release, (6, 6), through the lengths.

    Source:
        Nocedal, Wright 2006, Numerical Optimization, sec. 12.3 and 18.1: the KKT matrix of
        an equilibrium on its cables, differentiated.
    """
    values, n = bench.model.start_values, bench.model.robot.n_cables
    hessian = evaluate(bench.model.lagrangian, rest.zeta, rest.tensions, bench.inertia, values)[2]
    here = evaluate(bench.model.cables, rest.zeta, values)[3]
    there = evaluate(bench.model.cables, release, values)[3]
    matrix = np.block([[hessian, here.T], [here, np.zeros((n, n))]])
    right = np.vstack([np.zeros((6, 6)), there])
    return np.linalg.solve(matrix, right)[:6].astype(np.float64)
