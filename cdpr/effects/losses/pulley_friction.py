"""Friction between cable and pulley where the cable winds on and off with the wrap angle."""

from __future__ import annotations

import casadi as ca

from freeswing.cdpr.effects.base import AMPLITUDES, Effect, Instant, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot

# As in the swivels (`swivel_friction`).
SMOOTHING_RAD_S = 0.002


class PulleyFriction(Effect):
    """Torque coefficient x r x tension against the rate of the wrap angle psi."""

    name = "pulley_friction"
    summary = "friction of the cables on the pulleys"
    separated_by = (AMPLITUDES,)
    needs_tension = True

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """A friction coefficient, the same for all pulleys."""
        return (Parameter("coefficient", 0.0, 0.5, 0.02),)

    def generalised_force(self, instant: Instant, values: Expression) -> Expression:
        """Sum over the cables, r being the wrapped length over the wrap's angle."""
        total = ca.SX.zeros(6)
        for index, cable in enumerate(instant.cables):
            if cable.is_eyelet:
                continue
            radius = (cable.length - cable.straight) / (ca.pi - cable.wrap)
            sign = ca.tanh(instant.rate_of(cable.wrap) / SMOOTHING_RAD_S)
            effort = values[0] * radius * instant.tensions[index] * sign
            total += instant.against(cable.wrap, effort)
        return total


EFFECT = PulleyFriction()
