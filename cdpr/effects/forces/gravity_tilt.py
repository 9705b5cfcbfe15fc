"""A base frame that is not level."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from freeswing.cdpr.effects.base import EQUILIBRIA, PAYLOAD, Effect, Parameter
from freeswing.cdpr.model.body import Expression, small_rotation
from freeswing.cdpr.model.pulley import Geometry
from freeswing.cdpr.robot import Robot


class GravityTilt(Effect):
    """Gravity turned about the base frame's x and y axes."""

    name = "gravity_tilt"
    summary = "the base frame is not level"
    separated_by = (PAYLOAD, EQUILIBRIA)
    stage = "base"
    on_driven = True

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Two angles."""
        return tuple(Parameter(f"tilt_{axis}_rad", -0.1, 0.1, 0.01) for axis in "xy")

    def geometry(self, geometry: Geometry, values: Expression) -> Geometry:
        """Gravity turned by the two angles."""
        turn = small_rotation(ca.vertcat(values[0], values[1], 0))
        return replace(geometry, gravity=turn @ geometry.gravity)


EFFECT = GravityTilt()
