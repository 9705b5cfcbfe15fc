"""Balancing springs that are not as stiff as declared."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from freeswing.cdpr.effects.base import Effect, Parameter, each
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot

if TYPE_CHECKING:
    from freeswing.cdpr.driven.parameters import MotorTerms


class SpringConstant(Effect):
    """Balancing spring k_sp of each motor, on top of what is declared."""

    name = "spring_constant"
    summary = "a balancing spring stiffer or softer than declared"
    stage = "drive"
    on_driven = True
    on_free = False

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """One addition a motor."""
        return each(robot, "added", "N_m", -10.0, 10.0, 0.5)

    def motors(self, motors: MotorTerms, values: Expression) -> MotorTerms:
        """What is declared with the additions."""
        return replace(motors, spring=motors.spring + values * motors.spring_drum_radius**2)


EFFECT = SpringConstant()
