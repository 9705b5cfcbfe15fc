"""Cables that stretch with their tension, quasi-statically."""

from __future__ import annotations

import casadi as ca

from cdpr.body import Expression
from cdpr.effects.base import Effect, Instant, Parameter
from cdpr.robot import Robot


class CableElasticity(Effect):
    """Each cable is stretched by its tension: strain = compliance x specific tension.

    The parameter is the platform's mass over the axial stiffness EA, since free motion gives
    tensions per mass: 8 kg on EA = 100 kN is 8e-5 s^2/m.
    """

    name = "cable_elasticity"
    summary = "axial stretch of the cables"
    needs_tension = True

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Mass over EA, the same for all cables."""
        return (Parameter("mass_over_stiffness_s2_m", 0.0, 0.01, 2e-4),)

    def length_change(self, robot: Robot, instant: Instant, values: Expression) -> Expression:
        """Hooke's law on the whole cable from D, of which the stretched length is known."""
        lengths = ca.vertcat(*[cable.length for cable in instant.cables])
        strains = values[0] * instant.tensions
        return lengths * strains / (1 + strains)


EFFECT = CableElasticity()
