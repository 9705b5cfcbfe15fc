"""Cables that stretch with their tension, quasi-statically."""

from __future__ import annotations

import casadi as ca

from freeswing.cdpr.effects.base import LONG_RUN, PAYLOAD, Effect, Instant, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Array, Robot


class CableElasticity(Effect):
    """Each cable is stretched by its tension, a relaxation time late (Kelvin and Voigt).

    Tension = EA (strain + relaxation strain rate), so that strain = compliance (specific tension -
    relaxation x its rate) while the motion is slow. The compliance is the platform's mass over the
    axial stiffness EA, since free motion gives tensions per mass: 8 kg on EA = 100 kN is
    8e-5 s^2/m. The second parameter is compliance x relaxation: 1 ms makes it 8e-8 s^3/m.
    """

    name = "cable_elasticity"
    summary = "axial stretch of the cables and its damping"
    separated_by = (PAYLOAD, LONG_RUN)
    tolerance = "stretch_s2_m"
    needs_tension = True
    on_driven = True
    fully = "cable_vibration"

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Mass over EA and that times the relaxation time, the same for all cables."""
        return (
            Parameter("mass_over_stiffness_s2_m", 0.0, 0.01, 2e-4),
            Parameter("damping_s3_m", 0.0, 2e-5, 2e-7),
        )

    def length_change(self, robot: Robot, instant: Instant, values: Expression) -> Expression:
        """Hooke's law on the whole cable from D, of which the stretched length is known."""
        strains = values[0] * instant.tensions
        return _lengths(instant) * strains / (1 + strains)

    def length_lag(self, robot: Robot, instant: Instant, values: Expression) -> Expression:
        """By how much the stretch stays behind its tension."""
        return -values[1] * _lengths(instant) * instant.tensions

    def length_pattern(self, times_s: Array, lengths_m: Array, tensions: Array) -> Array:
        """The stretch of every cable for a compliance of one."""
        return (lengths_m * tensions)[..., None]

    def stretch(self, values: Array, mass_kg: float) -> tuple[float, float]:
        """Compliance and relaxation of the same two numbers, where the mass is known."""
        relaxation = float(values[1] / values[0]) if values[0] > 0.0 else 0.0
        return float(values[0] / mass_kg), relaxation


def _lengths(instant: Instant) -> Expression:
    return ca.vertcat(*[cable.length for cable in instant.cables])


EFFECT = CableElasticity()
