"""Linear air drag on translation, applied at a point between P and the centre of mass."""

from __future__ import annotations

import casadi as ca

from freeswing.cdpr.effects.base import AMPLITUDES, Clues, Effect, Instant, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot


class TranslationalDrag(Effect):
    """Force -rate (velocity of the point of application) over the platform's mass.

    The point lies at P + fraction (centre of mass - P): bodies are dragged where they are broad,
    not where P happens to be.
    """

    name = "translational_drag"
    summary = "linear drag on translation"
    separated_by = (AMPLITUDES,)
    on_driven = True

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Drag rate and where on the line from P to the centre of mass it acts."""
        return (
            Parameter("rate_1_s", 0.0, 2.0, 0.1),
            Parameter("centre_fraction", -1.0, 2.0, 0.5, start=0.5, amplitude=False),
        )

    def wrench(self, instant: Instant, values: Expression) -> Expression:
        """Drag force at its point of application."""
        lever = values[1] * instant.com
        velocity = instant.velocity + ca.cross(instant.omega, lever)
        return instant.force_at(lever, -values[0] * velocity)

    def shape_guesses(self, clues: Clues) -> tuple[dict[str, float], ...]:
        """Midway, and at P: a platform may turn about either, where a drag does nothing."""
        return ({"centre_fraction": 0.5}, {"centre_fraction": 0.0})


EFFECT = TranslationalDrag()
