"""Linear air drag on rotation."""

from __future__ import annotations

from freeswing.cdpr.effects.base import AMPLITUDES, Effect, Instant, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot


class RotationalDrag(Effect):
    """Torque -rate omega over the platform's mass."""

    name = "rotational_drag"
    summary = "linear drag on rotation"
    separated_by = (AMPLITUDES,)
    on_driven = True

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Specific drag torque for each rad/s."""
        return (Parameter("rate_m2_s", 0.0, 0.2, 0.005),)

    def wrench(self, instant: Instant, values: Expression) -> Expression:
        """Pure torque against the angular velocity."""
        return instant.torque(-values[0] * instant.omega)


EFFECT = RotationalDrag()
