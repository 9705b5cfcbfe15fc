"""A constant force at P, as from a steady draught or a hose."""

from __future__ import annotations

from freeswing.cdpr.effects.base import PAYLOAD, Effect, Instant, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot


class ConstantForce(Effect):
    """Constant force over the platform's mass, in the base frame, at P."""

    name = "constant_force"
    summary = "a constant force"
    separated_by = (PAYLOAD,)
    on_driven = True

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Three components."""
        return tuple(Parameter(f"force_{axis}_m_s2", -3.0, 3.0, 0.05) for axis in "xyz")

    def wrench(self, instant: Instant, values: Expression) -> Expression:
        """The force at P."""
        return instant.force_at(0 * values, values)


EFFECT = ConstantForce()
