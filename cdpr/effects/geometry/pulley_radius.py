"""Pulley radii that are not as declared."""

from __future__ import annotations

from dataclasses import replace

from freeswing.cdpr.effects.base import EQUILIBRIA, Effect, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.model.pulley import Geometry
from freeswing.cdpr.robot import Robot


class PulleyRadius(Effect):
    """Pulley radii larger or smaller than declared; fixed eyelets stay eyelets."""

    name = "pulley_radius"
    summary = "pulley radii that are not as declared"
    separated_by = (EQUILIBRIA,)
    tolerance = "pulley_radius_m"
    stage = "kinematics"

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """One difference a pulley that has a radius."""
        return tuple(
            Parameter(
                f"difference_{c.name}_m",
                -0.5 * c.pulley_radius_m,
                c.pulley_radius_m,
                0.002,
                part=c.name,
            )
            for c in robot.cables
            if c.pulley_radius_m > 0.0
        )

    def geometry(self, geometry: Geometry, values: Expression) -> Geometry:
        """The corrected radii."""
        radii, used = [], 0
        for radius in geometry.radii:
            eyelet = radius.is_zero()
            radii.append(radius if eyelet else radius + values[used])
            used += not eyelet
        return replace(geometry, radii=tuple(radii))


EFFECT = PulleyRadius()
