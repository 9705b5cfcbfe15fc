"""A predictive controller at the control rate: estimate, plan, keep to the motors' bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from freeswing.servo.design.mpc import PLAN_STEPS, Predictor
from freeswing.servo.design.plant import CONTROL_RATE_HZ
from freeswing.servo.synthesis.discretise import zero_order_hold
from freeswing.servo.synthesis.state_space import Array, StateSpace
from freeswing.servo.tensions.loop_kernels import FEASIBLE, NEAREST, distribute_rows

# Of the wrenches' weight: what keeps currents near their wish that no wrench tells apart.
SPARE_WEIGHT = 1e-6


@dataclass(frozen=True, slots=True)
class Bounds:
    """What the motors can do about the pose of the design.

    Attributes:
        at: [x y z roll pitch yaw], (6,).
        rest: F_ev that holds the platform there, (6,).
        matrix: W_I, (6, n).
        lower: least currents, (n,).
        upper: greatest currents, (n,).
        wish: currents that the tension distribution would like, (n,).
    """

    at: Array
    rest: Array
    matrix: Array
    lower: Array
    upper: Array
    wish: Array


class PredictiveRegulator:
    """Plans wrenches over `PLAN_STEPS` steps within the motors' currents; gives the first.

    Where the plan without bounds can be made by allowed currents it is the best one, and nothing
    is solved; else daqp finds the currents.

    Args:
        predictor: about the pose of `bounds`.
        bounds: of the motors.
    """

    def __init__(self, predictor: Predictor, bounds: Bounds) -> None:
        self._p, self._bounds = predictor, bounds
        n = len(predictor.A)
        inputs = np.hstack([predictor.B, predictor.observer])
        observer = StateSpace(
            predictor.A - predictor.observer @ predictor.C, inputs, np.eye(n), np.zeros((n, 12))
        )
        self._observer = zero_order_hold(observer, 1.0 / CONTROL_RATE_HZ)
        self._state, self._pose = np.zeros(n), np.zeros(6)
        self._plan = _free_plan(predictor)
        self._program = _Program(predictor, bounds)
        self.solved = 0

    def wrench(self, error: Array, asked: Array, new: bool) -> Array:
        """One sample."""
        p, n_plant = self._p, len(self._p.step_A)
        goal = asked - self._bounds.at
        self._pose = goal - error
        rest = p.by_pose @ goal + p.by_outside @ self._state[-6:]
        away = self._state[:n_plant] - rest[:n_plant]
        wrenches = rest[n_plant:] + (self._plan @ away).reshape(PLAN_STEPS, 6)
        if self._program.allows(wrenches):
            return wrenches[0]
        self.solved += 1
        return self._program.best(away, rest[n_plant:])

    def applied(self, wrench: Array) -> None:
        """End of the sample: what was given and seen moves the estimate."""
        seen = np.concatenate([wrench, self._pose])
        self._state = self._observer.A @ self._state + self._observer.B @ seen


def _free_plan(p: Predictor) -> Array:
    """Wrenches about those of rest by the state about that of rest, (6 steps, 12)."""
    closed, rows = p.step_A - p.step_B @ p.gain, []
    power = np.eye(len(p.step_A))
    for _ in range(PLAN_STEPS):
        rows.append(-p.gain @ power)
        power = closed @ power
    return np.vstack(rows)


class _Program:
    """The quadratic programme over the currents of all steps, its matrices made once."""

    def __init__(self, p: Predictor, bounds: Bounds) -> None:
        self._bounds = bounds
        reach, free = _prediction(p)
        steps = np.eye(PLAN_STEPS)
        blocks = scipy.linalg.block_diag(*[p.state_cost] * (PLAN_STEPS - 1), p.end_cost)
        costs = np.asarray(blocks, dtype=np.float64)
        wrenches = np.kron(steps, p.wrench_cost)
        self._hessian = reach.T @ costs @ reach + wrenches
        self._by_state = reach.T @ costs @ free
        self._matrix = np.kron(steps, bounds.matrix)
        whole = self._matrix.T @ self._hessian @ self._matrix
        spare = SPARE_WEIGHT * float(np.trace(whole)) / len(whole)
        self._spare = spare * np.tile(bounds.wish, PLAN_STEPS)
        self._whole = whole + spare * np.eye(len(whole))
        self._lower = np.tile(bounds.lower, PLAN_STEPS)
        self._upper = np.tile(bounds.upper, PLAN_STEPS)
        rows = (PLAN_STEPS, *bounds.matrix.shape)
        self._matrices = np.ascontiguousarray(np.broadcast_to(bounds.matrix, rows))
        self._ends = [
            np.ascontiguousarray(np.broadcast_to(end, (PLAN_STEPS, len(end))))
            for end in (bounds.lower, bounds.upper, bounds.wish)
        ]
        self._inverse = np.linalg.pinv(bounds.matrix)

    def allows(self, wrenches: Array) -> bool:
        """Whether allowed currents make all wrenches of a plan, (steps, 6)."""
        b = self._bounds
        whole = wrenches + b.rest
        currents = b.wish + (whole - b.matrix @ b.wish) @ self._inverse.T
        if (currents >= b.lower).all() and (currents <= b.upper).all():
            return True
        none = np.zeros_like(whole)
        lower, upper, wish = self._ends
        status = distribute_rows(self._matrices, whole, none, lower, upper, wish, NEAREST)[1]
        return bool((status == FEASIBLE).all())

    def best(self, away: Array, rest: Array) -> Array:
        """The first wrench of the best plan within the bounds, (6,).

        Args:
            away: state about that of rest, (12,).
            rest: wrench of rest about that of the design, (6,).
        """
        b = self._bounds
        constant = np.tile(b.rest + rest, PLAN_STEPS)
        slope = self._matrix.T @ (self._by_state @ away - self._hessian @ constant) - self._spare
        currents = solve_box(self._whole, slope, self._lower, self._upper)
        return b.matrix @ currents[: len(b.wish)] - b.rest


def _prediction(p: Predictor) -> tuple[Array, Array]:
    """States of all steps: by the wrenches (12 N, 6 N), by the first state (12 N, 12)."""
    n, m = p.step_B.shape
    reach, free = np.zeros((n * PLAN_STEPS, m * PLAN_STEPS)), np.empty((n * PLAN_STEPS, n))
    power = np.eye(n)
    for k in range(PLAN_STEPS):
        below = slice(n * k, n * (k + 1))
        if k:
            before = slice(n * (k - 1), n * k)
            reach[below] = p.step_A @ reach[before]
        reach[below, m * k : m * (k + 1)] = p.step_B
        power = p.step_A @ power
        free[below] = power
    return reach, free


def solve_box(H: Array, f: Array, lower: Array, upper: Array) -> Array:
    """The least of x' H x / 2 + f' x between bounds, by daqp.

    Raises:
        ValueError: where daqp does not come to an end.
    """
    import daqp

    n = len(f)
    sense = np.zeros(n, dtype=np.int32)
    x, _, flag, _ = daqp.solve(H, f, np.zeros((0, n)), upper, lower, sense)
    if flag != 1:
        raise ValueError(f"daqp found no currents between their limits (exit flag {flag})")
    return x
