"""Motors with other viscous friction than declared."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from freeswing.cdpr.effects.base import Effect, Parameter, each
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot

if TYPE_CHECKING:
    from freeswing.cdpr.driven.parameters import MotorTerms


class ViscousFriction(Effect):
    """Viscous friction f_v of each motor, on top of what is declared."""

    name = "viscous_friction"
    summary = "viscous friction of a motor other than declared"
    stage = "drive"
    on_driven = True
    on_free = False

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """One addition a motor."""
        return each(robot, "added", "N_m_s", -0.005, 0.01, 1e-4)

    def motors(self, motors: MotorTerms, values: Expression) -> MotorTerms:
        """What is declared with the additions."""
        return replace(motors, viscous=motors.viscous + values)


EFFECT = ViscousFriction()
