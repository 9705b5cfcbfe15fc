"""Gravity that is not as strong as the file says, or stamps whose clock runs at another rate.

No claim about the robot, and in no catalogue: the diagnosis asks it before an effect is told. A
clock that runs fast by a share e makes everything look slower, as gravity weaker by 2 e would.
"""

from __future__ import annotations

from dataclasses import replace

from freeswing.cdpr.effects.base import Effect, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.model.pulley import Geometry
from freeswing.cdpr.robot import Robot


class GravityScale(Effect):
    """Gravity stronger by a share."""

    name = "gravity_scale"
    summary = "gravity is not what the file says, or the stamps' clock runs at another rate"
    stage = "measurement"
    on_free = False

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """The share by which it is stronger."""
        return (Parameter("stronger", -0.1, 0.1, 0.01),)

    def geometry(self, geometry: Geometry, values: Expression) -> Geometry:
        """Gravity as it is."""
        return replace(geometry, gravity=(1 + values[0]) * geometry.gravity)


EFFECT = GravityScale()
