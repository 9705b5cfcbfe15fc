"""Friction where a cable leaves its output pulley."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from freeswing.cdpr.effects.base import Effect, Parameter, each
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot

if TYPE_CHECKING:
    from freeswing.cdpr.driven.parameters import MotorTerms


class OutputPulley(Effect):
    """A share of its tension that each cable loses on its output pulley (T_a is not T_e)."""

    name = "output_pulley"
    summary = "tension lost on an output pulley"
    stage = "drive"
    on_driven = True
    on_free = False

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """One addition a motor."""
        return each(robot, "coefficient", "", -0.2, 0.5, 0.02)

    def motors(self, motors: MotorTerms, values: Expression) -> MotorTerms:
        """What is declared with the additions."""
        return replace(motors, roll=motors.roll + values)


EFFECT = OutputPulley()
