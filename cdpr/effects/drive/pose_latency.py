"""Poses that are older than the session says."""

from __future__ import annotations

from dataclasses import replace

from freeswing.cdpr.effects.base import Effect, Parameter, Readings
from freeswing.cdpr.robot import Array, Robot


class PoseLatency(Effect):
    """A measured pose was true `added_s` before the time that the session's latency gives.

    What is measured changes, not the motion.
    """

    name = "pose_latency"
    summary = "poses that are older than declared"
    stage = "measurement"
    on_driven = True
    on_free = False

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """The additional delay."""
        return (Parameter("added_s", -0.05, 0.1, 0.002),)

    def readings(self, readings: Readings, values: Array) -> Readings:
        """Poses that much older."""
        return replace(readings, latency_s=readings.latency_s + values[0])


EFFECT = PoseLatency()
