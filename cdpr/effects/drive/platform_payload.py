"""Something on the platform that nobody declared."""

from __future__ import annotations

from freeswing.cdpr.effects.base import Effect, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot


class PlatformPayload(Effect):
    """A point mass fixed to the platform."""

    name = "platform_payload"
    summary = "an undeclared mass on the platform"
    stage = "force"
    on_driven = True
    on_free = False

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Mass, and where it sits in the platform frame."""
        places = (Parameter(f"{axis}_m", -0.3, 0.3, 0.05, amplitude=False) for axis in "xyz")
        return (Parameter("mass_kg", -0.1, 1.0, 0.02), *places)

    def payloads(self, values: Expression) -> list[tuple[Expression, Expression]]:
        """The point mass."""
        return [(values[0], values[1:4])]


EFFECT = PlatformPayload()
