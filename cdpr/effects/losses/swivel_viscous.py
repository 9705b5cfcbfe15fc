"""Viscous friction in the swivel bearings of the pulleys."""

from __future__ import annotations

import casadi as ca

from freeswing.cdpr.effects.base import AMPLITUDES, Effect, Instant, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot


class SwivelViscous(Effect):
    """Torque proportional to the swivel rate about every swivel axis."""

    name = "swivel_viscous"
    summary = "viscous friction in the swivel bearings"
    separated_by = (AMPLITUDES,)

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Specific torque for each rad/s, the same for all pulleys."""
        return (Parameter("rate_m2_s", 0.0, 1.0, 0.01),)

    def generalised_force(self, instant: Instant, values: Expression) -> Expression:
        """Sum over the pulleys of the torque against the swivel rate; eyelets do not swivel."""
        return sum(
            (
                instant.against(cable.swivel, values[0] * instant.rate_of(cable.swivel))
                for cable in instant.cables
                if not cable.is_eyelet
            ),
            ca.SX.zeros(6),
        )


EFFECT = SwivelViscous()
