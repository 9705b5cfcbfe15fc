"""Hooks or clamps at the upper ends that give way sideways, each by a spring of its own."""

from __future__ import annotations

import casadi as ca

from freeswing.cdpr.effects.base import (
    PAYLOAD,
    Effect,
    Instant,
    Parameter,
    Recorded,
    each,
)
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.model.pulley import CableState
from freeswing.cdpr.robot import Robot


class YieldingClamp(Effect):
    """A wire that leans by a pulls its hook sideways by d = T sin a / k, T the tension.

    Against the hook where it is told to be, the wire then seems longer by d sin a and pulls the
    platform less to the side, by T d / L: to first order in d, as a wire longer by T / k would.
    The compliance is the platform's mass over k, since free motion gives tensions per mass: 1.2 kg
    on 2 kN/m is 6e-4 s^2.
    """

    name = "yielding_clamp"
    summary = "hooks of the wires that give way sideways"
    separated_by = (PAYLOAD,)
    needs_tension = True

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """The platform's mass over every hook's stiffness."""
        return each(robot, "mass_over_stiffness", "s2", 0.0, 0.02, 1e-3)

    def length_change(self, robot: Robot, instant: Instant, values: Expression) -> Expression:
        """By how much the yielded hook makes every wire seem longer."""
        aside = [ca.sumsqr(_aside(cable)) for cable in instant.cables]
        return values * instant.tensions * ca.vertcat(*aside)

    def wrench(self, instant: Instant, values: Expression) -> Expression:
        """What all wires pull less to the side."""
        total = ca.SX.zeros(6)
        for k, cable in enumerate(instant.cables):
            force = values[k] * instant.tensions[k] ** 2 / cable.length * _aside(cable)
            total += instant.force_at(cable.lever, force)
        return total

    def cannot_show(self, robot: Robot, recorded: Recorded) -> str:
        """Cables over pulleys have no hooks."""
        if robot.radii_m.any() or robot.n_cables > 3:
            return "cables that winches hold run over pulleys or through eyelets, not from hooks"
        return super().cannot_show(robot, recorded)


def _aside(cable: CableState) -> Expression:
    """The horizontal part of a wire's direction, from the hook down, (3,)."""
    return ca.vertcat(cable.direction[0], cable.direction[1], 0)


EFFECT = YieldingClamp()
