"""A measured point that is not the reference point P."""

from __future__ import annotations

import casadi as ca

from freeswing.cdpr.effects.base import EQUILIBRIA, Effect, Instant, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot


class MarkerOffset(Effect):
    """The measured position is that of P + R offset."""

    name = "marker_offset"
    summary = "the measured point is not P"
    separated_by = (EQUILIBRIA,)
    tolerance = "reference_m"
    stage = "kinematics"

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Offset in the platform frame."""
        return tuple(Parameter(f"offset_{axis}_m", -0.05, 0.05, 0.005) for axis in "xyz")

    def measured(self, instant: Instant, values: Expression) -> Expression:
        """Translation of what is measured."""
        return ca.vertcat(instant.rotation @ values, ca.SX.zeros(3))


EFFECT = MarkerOffset()
