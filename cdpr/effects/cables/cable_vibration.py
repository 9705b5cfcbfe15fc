"""Cables that vibrate along themselves: what stretching ones do beside following their tension."""

from __future__ import annotations

from freeswing.cdpr.effects.base import Effect, Parameter
from freeswing.cdpr.robot import Robot


class CableVibration(Effect):
    """The platform on damped springs beside `cable_elasticity`: the full motion, not its slow part.

    It is no claim about the robot: where cables stretch a run may begin with them plucked, and each
    has the lengths that its winches paid out for itself. Tensions follow from the stretch of these
    (`cdpr.model.elastic_motion`); every state is admissible.
    """

    name = "cable_vibration"
    summary = "vibration of the platform on its stretching cables"
    on_free = False  # in no catalogue: cables that stretch are what is looked for
    nuisance = True
    springs = True

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """How much a start may pluck cables, held; unstretched lengths from D (`at_ease`).

        Whoever lets go of a platform that hung from its cables, but for the swing, hardly does; one
        whose cables were slack plucks them by its weight.
        """
        plucked = Parameter("plucked", 0.0, 1.0, 0.01, start=0.01, amplitude=False)
        return plucked, *(
            Parameter(
                f"unstretched_{cable.name}_m",
                0.01,
                100.0,
                0.01,
                start=1.0,
                amplitude=False,
                per_run=True,
                part=cable.name,
            )
            for cable in robot.cables
        )


EFFECT = CableVibration()
