"""Cables that weigh something."""

from __future__ import annotations

from freeswing.cdpr.effects.base import PAYLOAD, Effect, Instant, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot


class CableMass(Effect):
    """Half of each cable's weight and a third of its inertia ride on the attachment point.

    A taut cable that pivots about its pulley carries kinetic energy mu l |v_A|^2 / 6. Sag is
    left out: at 20 N and 5 g/m its extra length is below 0.01 mm a metre.
    """

    name = "cable_mass"
    summary = "weight and inertia of the cables"
    separated_by = (PAYLOAD,)

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Cable mass per metre over the platform's mass, the same for all cables."""
        return (Parameter("linear_density_over_mass_1_m", 0.0, 0.05, 0.002),)

    def point_masses(
        self, robot: Robot, instant: Instant, values: Expression
    ) -> list[tuple[Expression, Expression, Expression]]:
        """A mass at every attachment point."""
        masses = [values[0] * cable.straight for cable in instant.cables]
        return [(c.lever, m / 3, m / 2) for c, m in zip(instant.cables, masses, strict=True)]


EFFECT = CableMass()
