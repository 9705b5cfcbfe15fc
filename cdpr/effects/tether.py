"""A soft umbilical or safety line that pulls on the platform."""

from __future__ import annotations

from cdpr.body import Expression
from cdpr.effects.base import Effect, Instant, Parameter
from cdpr.robot import Robot


class Tether(Effect):
    """A soft spring at P: force pull - stiffness (p - centre of the pulleys), over the mass."""

    name = "tether"
    summary = "a soft spring that ties the platform to the frame"

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Specific stiffness and the pull where P is at the mean of the cable entries."""
        stiffness = Parameter("stiffness_1_s2", 0.0, 20.0, 0.5)
        pull = tuple(Parameter(f"pull_{axis}_m_s2", -10.0, 10.0, 0.3) for axis in "xyz")
        return (stiffness, *pull)

    def wrench(self, instant: Instant, values: Expression) -> Expression:
        """The spring's force at P."""
        return instant.force_at(0 * values[1:4], values[1:4] - values[0] * instant.zeta[:3])


EFFECT = Tether()
