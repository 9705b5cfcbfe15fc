"""Told cable lengths that are wrong by a constant for each cable."""

from __future__ import annotations

from freeswing.cdpr.effects.base import (
    EQUILIBRIA,
    LONG_RUN,
    Effect,
    Instant,
    Parameter,
    Recorded,
    each,
)
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot


class CableLengthBias(Effect):
    """Each cable is longer than told by the same amount in every run."""

    name = "cable_length_bias"
    summary = "the told cable lengths are biased"
    separated_by = (EQUILIBRIA, LONG_RUN)
    stage = "kinematics"

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """One bias a cable."""
        return each(robot, "bias", "m", -0.1, 0.1, 0.005)

    def length_change(self, robot: Robot, instant: Instant, values: Expression) -> Expression:
        """The biases."""
        return values

    def cannot_show(self, robot: Robot, recorded: Recorded) -> str:
        """A bias of what nobody stated means nothing."""
        if not recorded.lengths:
            return "no cable lengths are stated: nothing to be biased"
        return super().cannot_show(robot, recorded)


EFFECT = CableLengthBias()
