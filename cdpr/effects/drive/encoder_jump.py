"""Encoders that lost counts."""

from __future__ import annotations

from freeswing.cdpr.effects.base import Effect, Parameter, each
from freeswing.cdpr.robot import Robot


class EncoderJump(Effect):
    """Each motor's angle is read with an offset from `after_s` on: counts were lost.

    What is measured changes, not the motion: simulation and fits add the offset.
    """

    name = "encoder_jump"
    summary = "an encoder that lost counts"
    stage = "measurement"
    on_driven = True
    on_free = False

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """One jump a motor, and when."""
        when = Parameter("after_s", 0.0, 3600.0, 1.0, amplitude=False)
        return (*each(robot, "jump", "rad", -20.0, 20.0, 0.05), when)


EFFECT = EncoderJump()
