"""Attachment points that are not where they were declared."""

from __future__ import annotations

from dataclasses import replace

from freeswing.cdpr.effects.base import EQUILIBRIA, Effect, Parameter, each_axis
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.model.pulley import Geometry
from freeswing.cdpr.robot import Robot


class AttachmentOffset(Effect):
    """Attachment points A displaced in the platform frame."""

    name = "attachment_offset"
    summary = "attachment points that are not where they were declared"
    separated_by = (EQUILIBRIA,)
    tolerance = "attachment_m"
    stage = "kinematics"
    on_driven = True

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Three coordinates a cable."""
        return each_axis(robot, "offset", "xyz", "m", 0.03, 0.003)

    def geometry(self, geometry: Geometry, values: Expression) -> Geometry:
        """The displaced points."""
        points = tuple(p + values[3 * i : 3 * i + 3] for i, p in enumerate(geometry.attachments))
        return replace(geometry, attachments=points)


EFFECT = AttachmentOffset()
