"""Winches that let the cables slip slowly."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.effects.base import LONG_RUN, Effect, Instant, Parameter, each
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Array, Robot


class WinchCreep(Effect):
    """Each cable lengthens at a constant rate along a run."""

    name = "winch_creep"
    summary = "cables that slowly run out"
    separated_by = (LONG_RUN,)
    tolerance = "creep_m_s"
    stage = "kinematics"

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """One rate a cable."""
        return each(robot, "rate", "m_s", -0.01, 0.01, 5e-5)

    def length_change(self, robot: Robot, instant: Instant, values: Expression) -> Expression:
        """Rate times time."""
        return values * instant.time_s

    def length_pattern(self, times_s: Array, lengths_m: Array, tensions: Array) -> Array:
        """Time since the middle, each cable for itself."""
        since = times_s - times_s.mean()
        return np.multiply.outer(since, np.eye(lengths_m.shape[1]))


EFFECT = WinchCreep()
