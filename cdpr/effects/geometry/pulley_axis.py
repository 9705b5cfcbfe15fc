"""Swivel axes that do not point where they were declared."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from freeswing.cdpr.effects.base import EQUILIBRIA, Effect, Parameter
from freeswing.cdpr.model.body import Expression, small_rotation
from freeswing.cdpr.model.pulley import Geometry
from freeswing.cdpr.robot import Robot


class PulleyAxis(Effect):
    """Each swivel axis turned about the x and y axes of its own swivel frame."""

    name = "pulley_axis"
    summary = "swivel axes that do not point as declared"
    separated_by = (EQUILIBRIA,)
    tolerance = "swivel_rad"
    stage = "kinematics"

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Two angles a pulley that has a radius."""
        return tuple(
            Parameter(f"tilt_{c.name}_{axis}_rad", -0.2, 0.2, 0.02)
            for c in robot.cables
            if c.pulley_radius_m > 0.0
            for axis in "xy"
        )

    def geometry(self, geometry: Geometry, values: Expression) -> Geometry:
        """The turned swivel frames."""
        axes, used = [], 0
        for frame, radius in zip(geometry.axes, geometry.radii, strict=True):
            if radius.is_zero():
                axes.append(frame)
                continue
            axes.append(small_rotation(ca.vertcat(values[used], values[used + 1], 0)).T @ frame)
            used += 2
        return replace(geometry, axes=tuple(axes))


EFFECT = PulleyAxis()
