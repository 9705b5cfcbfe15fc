"""Linear model predictive control: an observer of wrenches from outside, and a plan ahead.

The plan minimises what a linear-quadratic regulator minimises, with that regulator's own cost at
its end, so that without bounds it is the regulator; the bounds are the motors' (Rawlings, Mayne,
Diehl, "Model Predictive Control", sections 1.3, 1.5, 2.5). An observer of the wrench that acts
besides takes the place of an integral: what friction holds back is seen as such and outweighed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from freeswing.servo.design.lqg import FILTER_RATIO
from freeswing.servo.design.plant import Plant
from freeswing.servo.synthesis.discretise import zero_order_hold
from freeswing.servo.synthesis.state_space import Array, StateSpace

# The plan's step and length: a fifth of a second reaches past the first swing of a loop of 10
# rad/s, and what comes later is in the cost at its end.
PLAN_STEP_S = 0.02
PLAN_STEPS = 10


@dataclass(frozen=True, slots=True)
class Predictor:
    """What a predictive controller is made of; all numbers about the pose of its design.

    Attributes:
        A: of plant, delay and outside wrench, (n, n), continuous.
        B: the same, by the wrench, (n, 6).
        C: the same, to the pose as it is measured, (6, n).
        observer: L of the Kalman filter, (n, 6).
        step_A: the plant alone over one step of the plan, (12, 12).
        step_B: the same, by the wrench, (12, 6).
        gain: K of the plan without bounds, wrench = -K state, (6, 12).
        state_cost: Q of a step, (12, 12).
        wrench_cost: R of a step, (6, 6).
        end_cost: P of the last state, (12, 12).
        by_pose: [state; wrench] at rest by the pose asked for, (18, 6).
        by_outside: the same by the wrench from outside, (18, 6).
    """

    A: Array
    B: Array
    C: Array
    observer: Array
    step_A: Array
    step_B: Array
    gain: Array
    state_cost: Array
    wrench_cost: Array
    end_cost: Array
    by_pose: Array
    by_outside: Array

    @property
    def law(self) -> Array:
        """F of wrench = -F [estimate] without bounds, for a pose of zero asked for, (6, n)."""
        n_plant, n = len(self.step_A), len(self.A)
        F = np.zeros((6, n))
        F[:, :n_plant] = self.gain
        F[:, n - 6 :] = -(self.by_outside[n_plant:] + self.gain @ self.by_outside[:n_plant])
        return F

    def unbounded(self) -> StateSpace:
        """Pose error to wrench where no bound is met."""
        F = self.law
        A = self.A - self.observer @ self.C - self.B @ F
        return StateSpace(A, -self.observer, -F, np.zeros((6, 6)))


def design_mpc(plant: Plant, speeds_rad_s: Array) -> Predictor:
    """The predictor of given speeds.

    Pose errors weigh speed^4, rates 2 speed^2, wrenches M_o^-2: of 1/s^2 two poles at -speed, and
    modes that springs make faster than that are damped. The observer takes a wrench from outside
    that walks by M_o^2 speed^6 against white pose noise: a Butterworth pattern `FILTER_RATIO`
    faster, as LQG's.

    Args:
        plant: wrench to pose, and its delay.
        speeds_rad_s: of each axis, (6,).
    """
    speeds = np.asarray(speeds_rad_s, dtype=np.float64)
    late, bare = plant.delayed(), plant.system
    n_plant, n_late = bare.order, late.order
    inverse = np.linalg.inv(plant.mass)
    step = zero_order_hold(bare, PLAN_STEP_S)
    Q = PLAN_STEP_S * np.diag(np.concatenate([speeds**4, 2.0 * speeds**2]))
    R = PLAN_STEP_S * inverse.T @ inverse
    P = scipy.linalg.solve_discrete_are(step.A, step.B, Q, R)
    gain = np.linalg.solve(R + step.B.T @ P @ step.B, step.B.T @ P @ step.A)
    A = np.zeros((n_late + 6, n_late + 6))
    A[:n_late, :n_late], A[:n_late, n_late:] = late.A, late.B
    B = np.vstack([late.B, np.zeros((6, 6))])
    C = np.hstack([late.C, np.zeros((6, 6))])
    walk = np.zeros((n_late + 6, 6))
    walk[n_late:] = plant.mass * (FILTER_RATIO * speeds) ** 3
    Y = scipy.linalg.solve_continuous_are(
        A.T, C.T, walk @ walk.T + 1e-9 * np.eye(n_late + 6), np.eye(6)
    )
    # State and wrench of any drift and pose at rest.
    whole = np.linalg.inv(np.block([[bare.A, bare.B], [bare.C, np.zeros((6, 6))]]))
    rest = np.asarray(whole, dtype=np.float64)
    return Predictor(
        A, B, C, Y @ C.T, step.A, step.B, gain, Q, R, P,
        rest[:, n_plant:], -rest[:, :n_plant] @ bare.B,
    )  # fmt: skip
