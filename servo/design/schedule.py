"""Gain scheduling by the pose: one controller whose wrench is turned into that of the place.

The plant's inertia M_o, most of it the motors', changes with the pose; a wrench that accelerates
the platform here as the controller's own would at the pose of its design makes the two plants one
at high rates (input transformation; Rugh, Shamma 2000, section 3).
"""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.driven.linear import linear_model
from freeswing.cdpr.driven.model import DrivenModel
from freeswing.servo.design.plant import Plant
from freeswing.servo.synthesis.state_space import Array, StateSpace


class Schedule:
    """Gives the factor T of the wrench at one pose after another.

    Args:
        model: the controller's own.
        at: the pose of the design, (6,).
    """

    def __init__(self, model: DrivenModel, at: Array) -> None:
        self._model = model
        self._design = self._pushes(at)

    def factor(self, pose: Array) -> Array:
        """T with B(pose) T = B(design), (6, 6)."""
        turned = np.linalg.solve(self._pushes(pose), self._design)
        return np.asarray(turned, dtype=np.float64)

    def _pushes(self, pose: Array) -> Array:
        """Accelerations by wrenches, (6, 6)."""
        return linear_model(self._model, pose).B[6:]


def scheduled(plant: Plant, factor: Array) -> Plant:
    """The plant as a scheduled controller sees it."""
    s = plant.system
    turned = StateSpace(s.A, s.B @ factor, s.C, s.D)
    return Plant(plant.at, plant.wrench, plant.mass, turned, plant.delay_s)
