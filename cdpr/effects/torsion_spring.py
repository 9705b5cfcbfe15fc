"""A torsional stiffness about the vertical, as from a stiff umbilical or twisted cables."""

from __future__ import annotations

import casadi as ca

from cdpr.body import Expression
from cdpr.effects.base import Effect, Instant, Parameter
from cdpr.robot import Robot


class TorsionSpring(Effect):
    """Torque moment - stiffness chi about the base frame's z axis, over the mass."""

    name = "torsion_spring"
    summary = "a torsional spring in yaw"

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Specific stiffness, and the torque at zero yaw."""
        return (
            Parameter("stiffness_m2_s2", 0.0, 2.0, 0.02),
            Parameter("moment_m2_s2", -1.0, 1.0, 0.01),
        )

    def wrench(self, instant: Instant, values: Expression) -> Expression:
        """Pure torque in yaw."""
        return instant.torque(ca.vertcat(0, 0, values[1] - values[0] * instant.zeta[5]))


EFFECT = TorsionSpring()
