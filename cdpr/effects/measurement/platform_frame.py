"""The platform's frame sits a little differently in every run: markers were touched."""

from __future__ import annotations

import casadi as ca

from freeswing.cdpr.effects.base import Effect, Instant, Parameter, Recorded
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot


class PlatformFrame(Effect):
    """A constant small shift and turn of the measured frame in the platform, new in each run.

    It is no claim about the robot: a nuisance beside all effects where poses come from markers or
    tags, whose layout a run knows to half a millimetre and two milliradians.
    """

    name = "platform_frame"
    summary = "a measured frame that sits a little differently in each run"
    stage = "measurement"
    nuisance = True

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Shift and rotation vector in the platform frame."""
        known = robot.tolerances
        sizes = {"shift": ("m", known.frame_m), "turn": ("rad", known.frame_rad)}
        return tuple(
            Parameter(f"{stem}_{axis}_{unit}", -3.0 * size, 3.0 * size, size, per_run=True)
            for stem, (unit, size) in sizes.items()
            for axis in "xyz"
        )

    def cannot_show(self, robot: Robot, recorded: Recorded) -> str:
        """Poses that do not say how far they err together are taken at their word."""
        return "" if recorded.slow_errors else "no run's poses state how far they err together"

    def measured(self, instant: Instant, values: Expression) -> Expression:
        """Both in the base frame."""
        return ca.vertcat(instant.rotation @ values[:3], instant.rotation @ values[3:])


EFFECT = PlatformFrame()
