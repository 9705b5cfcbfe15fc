"""A torsional stiffness about the vertical, as from a stiff umbilical or twisted cables."""

from __future__ import annotations

import casadi as ca

from freeswing.cdpr.effects.base import PAYLOAD, Effect, Instant, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot


class TorsionSpring(Effect):
    """Potential stiffness heading^2 / 2 - moment heading, over the mass.

    The heading is that of the platform's x axis about the base frame's z axis: equal to chi when
    phi and theta are zero, and continuous through +-180 degrees.
    """

    name = "torsion_spring"
    summary = "a torsional spring in yaw"
    separated_by = (PAYLOAD,)

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Specific stiffness, and the torque at zero yaw."""
        return (
            Parameter("stiffness_m2_s2", 0.0, 2.0, 0.02),
            Parameter("moment_m2_s2", -1.0, 1.0, 0.01),
        )

    def generalised_force(self, instant: Instant, values: Expression) -> Expression:
        """The potential's gradient, so that the spring keeps energy at any tilt."""
        chi, turn = instant.zeta[5], instant.rotation
        ahead = turn[0, 0] * ca.cos(chi) + turn[1, 0] * ca.sin(chi)
        aside = turn[1, 0] * ca.cos(chi) - turn[0, 0] * ca.sin(chi)
        heading = chi + ca.atan2(aside, ahead)
        return instant.against(heading, values[0] * heading - values[1])


EFFECT = TorsionSpring()
