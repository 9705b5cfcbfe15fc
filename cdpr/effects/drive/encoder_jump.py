"""Encoders that lost counts."""

from __future__ import annotations

from dataclasses import replace

from freeswing.cdpr.effects.base import Effect, Parameter, Readings, each
from freeswing.cdpr.robot import Array, Robot


class EncoderJump(Effect):
    """Each motor's angle is read with an offset from `after_s` on: counts were lost.

    What is measured changes, not the motion.
    """

    name = "encoder_jump"
    summary = "an encoder that lost counts"
    stage = "measurement"
    on_driven = True
    on_free = False

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """One jump a motor, and when."""
        when = Parameter("after_s", 0.0, 3600.0, 1.0, start=1.0, amplitude=False)
        return (*each(robot, "jump", "rad", -20.0, 20.0, 0.05), when)

    def readings(self, readings: Readings, values: Array) -> Readings:
        """Angles with the lost counts in them."""
        after = readings.times_s[:, None] >= values[-1]
        return replace(readings, offsets_rad=readings.offsets_rad + after * values[:-1])


EFFECT = EncoderJump()
