"""A force that oscillates at one frequency, as from a fan or an unbalanced motor."""

from __future__ import annotations

import casadi as ca

from freeswing.cdpr.effects.base import LONG_RUN, Clues, Effect, Instant, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot


class HarmonicForce(Effect):
    """Force at P over the mass, with a cosine and a sine part in each direction.

    Recordings are not synchronised with a fan: amplitudes and phases are each run's own, the
    frequency is shared.
    """

    name = "harmonic_force"
    summary = "a force at one frequency"
    separated_by = (LONG_RUN,)

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Six amplitudes and a frequency."""
        parts = tuple(
            Parameter(f"{part}_{axis}_m_s2", -3.0, 3.0, 0.05, per_run=True)
            for part in ("cosine", "sine")
            for axis in "xyz"
        )
        return (*parts, Parameter("frequency_hz", 0.05, 40.0, 2.0, start=2.0, amplitude=False))

    def wrench(self, instant: Instant, values: Expression) -> Expression:
        """The force at P."""
        phase = 2 * ca.pi * values[6] * instant.time_s
        force = values[0:3] * ca.cos(phase) + values[3:6] * ca.sin(phase)
        return instant.force_at(0 * force, force)

    def shape_guesses(self, clues: Clues) -> tuple[dict[str, float], ...]:
        """Lines that all residuals share: a fan's, while modes differ from run to run."""
        return tuple({"frequency_hz": one} for one in clues.common_frequencies_hz())


EFFECT = HarmonicForce()
