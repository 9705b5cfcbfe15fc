"""Air drag that grows with the square of the speed."""

from __future__ import annotations

import casadi as ca

from freeswing.cdpr.effects.base import AMPLITUDES, Clues, Effect, Instant, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot


class QuadraticDrag(Effect):
    """Force -coefficient |v| v over the platform's mass, v of a point as in linear drag."""

    name = "quadratic_drag"
    summary = "quadratic drag on translation"
    separated_by = (AMPLITUDES,)
    on_driven = True

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Drag area times density over twice the mass, and the point of application."""
        return (
            Parameter("coefficient_1_m", 0.0, 5.0, 0.2),
            Parameter("centre_fraction", -1.0, 2.0, 0.5, start=0.5, amplitude=False),
        )

    def wrench(self, instant: Instant, values: Expression) -> Expression:
        """Drag force at its point of application."""
        lever = values[1] * instant.com
        velocity = instant.velocity + ca.cross(instant.omega, lever)
        speed = ca.sqrt(ca.dot(velocity, velocity) + 1e-8)
        return instant.force_at(lever, -values[0] * speed * velocity)

    def shape_guesses(self, clues: Clues) -> tuple[dict[str, float], ...]:
        """Midway, and at P: a platform may turn about either, where a drag does nothing."""
        return ({"centre_fraction": 0.5}, {"centre_fraction": 0.0})


EFFECT = QuadraticDrag()
