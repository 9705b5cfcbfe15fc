"""Orientations that are stamped later than they were seen."""

from __future__ import annotations

import casadi as ca

from freeswing.cdpr.effects.base import Effect, Instant, Parameter
from freeswing.cdpr.model.body import Expression, along
from freeswing.cdpr.robot import Robot


class ClockOffset(Effect):
    """A measured orientation is the one that the platform had `delay` before its time stamp.

    Position and orientation then come from instruments whose clocks differ. Second order in the
    delay: good to 0.1 mrad for 20 ms at 1 Hz and 10 degrees.
    """

    name = "clock_offset"
    summary = "orientations that lag behind the positions"
    stage = "measurement"
    tolerance = "clock_s"

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """The delay."""
        return (Parameter("delay_s", -0.05, 0.05, 0.005),)

    def measured(self, instant: Instant, values: Expression) -> Expression:
        """The turn that is still to come."""
        state = ca.vertcat(instant.zeta, instant.rates)
        spin_up = along(instant.omega, state, ca.vertcat(instant.rates, instant.second_rates))
        return ca.vertcat(ca.SX.zeros(3), values[0] ** 2 / 2 * spin_up - values[0] * instant.omega)


EFFECT = ClockOffset()
