"""The robot as the linear system that controllers are designed for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.driven.linear import LinearModel, linear_model
from freeswing.cdpr.driven.model import DrivenModel
from freeswing.servo.synthesis.discretise import pade
from freeswing.servo.synthesis.state_space import Array, StateSpace, series

CENTRE = np.zeros(6)
# Order of the all-pass that stands for the pose's age: 1 degree of phase up to 1.7 / delay, 120
# rad/s at 13.7 ms, ten times the fastest bandwidth asked for here.
PADE_ORDER = 2
CONTROL_RATE_HZ = 1000


@dataclass(frozen=True, slots=True)
class Plant:
    """Wrench to pose about one pose.

    Attributes:
        at: [x y z roll pitch yaw] of eq. (1), (6,).
        wrench: F_ev that holds it there, (6,).
        mass: M_o, (6, 6).
        system: eq. (17).
        delay_s: how old the pose is, on average, when the controller uses it.
    """

    at: Array
    wrench: Array
    mass: Array
    system: StateSpace
    delay_s: float

    def delayed(self) -> StateSpace:
        """With its delay as an all-pass in every measurement."""
        if self.delay_s == 0.0:
            return self.system
        return series(self.system, pade(self.delay_s, PADE_ORDER, 6))


def plant_at(
    model: DrivenModel, at: Array = CENTRE, delay_s: float = 0.0, theta: Array | None = None
) -> Plant:
    """The plant about a pose.

    Args:
        model: the driven robot.
        at: [x y z roll pitch yaw], (6,).
        delay_s: of its measurements.
        theta: the model's numbers; None as declared.
    """
    linear: LinearModel = linear_model(model, at, theta)
    system = StateSpace(linear.A, linear.B, linear.C, linear.D)
    return Plant(np.array(at, dtype=np.float64), linear.wrench, linear.mass, system, delay_s)


def state_names() -> list[str]:
    """One name for each state of the weighted problem without delay, for sentences."""
    axes = ("x", "y", "z", "roll", "pitch", "yaw")
    return [*axes, *(f"the rate of {axis}" for axis in axes)]
