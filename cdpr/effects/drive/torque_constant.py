"""Motors whose torque for a current is not as declared."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from freeswing.cdpr.effects.base import Effect, Parameter, each
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot

if TYPE_CHECKING:
    from freeswing.cdpr.driven.parameters import MotorTerms


class TorqueConstant(Effect):
    """Torque constant k_em of each motor, on top of what is declared."""

    name = "torque_constant"
    summary = "torque per current of a motor other than declared"
    stage = "drive"
    on_driven = True
    on_free = False

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """One addition a motor."""
        return each(robot, "added", "N_m_A", -0.02, 0.02, 1e-3)

    def motors(self, motors: MotorTerms, values: Expression) -> MotorTerms:
        """What is declared with the additions."""
        return replace(motors, torque_constant=motors.torque_constant + values)


EFFECT = TorqueConstant()
