"""Winches that let the cables slip slowly."""

from __future__ import annotations

from freeswing.cdpr.effects.base import Effect, Instant, Parameter, each
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot


class WinchCreep(Effect):
    """Each cable lengthens at a constant rate along a run."""

    name = "winch_creep"
    summary = "cables that slowly run out"
    stage = "kinematics"

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """One rate a cable."""
        return each(robot, "rate", "m_s", -0.01, 0.01, 5e-5)

    def length_change(self, robot: Robot, instant: Instant, values: Expression) -> Expression:
        """Rate times time."""
        return values * instant.time_s


EFFECT = WinchCreep()
