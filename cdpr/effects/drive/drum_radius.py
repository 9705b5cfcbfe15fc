"""Drums that are larger or smaller than declared."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from freeswing.cdpr.effects.base import Effect, Parameter, each
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot

if TYPE_CHECKING:
    from freeswing.cdpr.driven.parameters import MotorTerms


class DrumRadius(Effect):
    """Radius r_pm of each drum, on top of what is declared."""

    name = "drum_radius"
    summary = "a drum whose radius is not as declared"
    stage = "drive"
    on_driven = True
    on_free = False

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """One addition a motor."""
        return each(robot, "added", "m", -0.003, 0.003, 2e-4)

    def motors(self, motors: MotorTerms, values: Expression) -> MotorTerms:
        """What is declared with the additions."""
        return replace(motors, drum_radius=motors.drum_radius + values)


EFFECT = DrumRadius()
