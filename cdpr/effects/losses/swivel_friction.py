"""Dry friction in the swivel bearings of the pulleys."""

from __future__ import annotations

import casadi as ca

from freeswing.cdpr.effects.base import AMPLITUDES, Effect, Instant, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot

# Five times as wide it left 1 % of the noise's power at a mode beside large friction, and that was
# taken for a force; half as wide changes nothing, in more segments (docs/decisions/diagnosis.md).
SMOOTHING_RAD_S = 0.002


class SwivelFriction(Effect):
    """Coulomb torque about every swivel axis, smoothed over +-0.002 rad/s."""

    name = "swivel_friction"
    summary = "dry friction in the swivel bearings"
    separated_by = (AMPLITUDES,)
    dry = True

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Friction torque over the platform's mass, the same for all pulleys."""
        return (Parameter("torque_m2_s2", 0.0, 0.1, 0.002),)

    def generalised_force(self, instant: Instant, values: Expression) -> Expression:
        """Sum over the pulleys of the torque against the swivel rate; eyelets do not swivel."""
        return sum(
            (
                instant.against(
                    cable.swivel,
                    values[0] * ca.tanh(instant.rate_of(cable.swivel) / SMOOTHING_RAD_S),
                )
                for cable in instant.cables
                if not cable.is_eyelet
            ),
            ca.SX.zeros(6),
        )


EFFECT = SwivelFriction()
