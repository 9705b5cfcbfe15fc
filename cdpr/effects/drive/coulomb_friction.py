"""Motors with other dry friction than declared."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from freeswing.cdpr.effects.base import Effect, Parameter, each
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot

if TYPE_CHECKING:
    from freeswing.cdpr.driven.parameters import MotorTerms


class CoulombFriction(Effect):
    """Coulomb friction f_c of each motor, on top of what is declared."""

    name = "coulomb_friction"
    summary = "dry friction of a motor other than declared"
    stage = "drive"
    on_driven = True
    on_free = False

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """One addition a motor."""
        return each(robot, "added", "N_m", -0.01, 0.02, 1e-3)

    def motors(self, motors: MotorTerms, values: Expression) -> MotorTerms:
        """What is declared with the additions."""
        return replace(motors, coulomb=motors.coulomb + values)


EFFECT = CoulombFriction()
