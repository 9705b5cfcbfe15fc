"""How far a robot may be from its description where nobody has erred, and where somebody has.

The one table of physical priors. A workshop drills attachments to half a millimetre, a tape measure
or tachymeter places anchors to one, a spirit level sets an axis to half a degree; locked winches
creep by a micrometre a second. Whatever is farther off was measured, drawn or mounted wrongly: by
`gross` times its tolerance in the typical case.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Standard deviations of what is as declared; robot.toml's `[tolerances]` may override each.

    Attributes:
        entry_m: of a coordinate of D in the base frame: a tape measure or a tachymeter.
        attachment_m: of a coordinate of A in the platform frame: drawing and drill.
        pulley_radius_m: of the groove's radius with half the cable's diameter: a calliper.
        swivel_rad: of a swivel axis: a spirit level on a bracket.
        reference_m: of the measured point's place in the platform frame.
        frame_m: of the platform frame that markers or tags give, from run to run, where poses
            state how far they err together; beside what is stated.
        frame_rad: of its orientation.
        clock_s: between the clocks of positions and orientations.
        creep_m_s: of a cable on a locked winch.
        stretch_s2_m: mass of the platform over EA: steel of 1 mm under 8 kg has 1e-4.
        gross: how many times a tolerance something is off that was measured or mounted wrongly.
        declared: names of those that robot.toml itself states, though they be the usual ones.
    """

    entry_m: float = 1e-3
    attachment_m: float = 5e-4
    pulley_radius_m: float = 2e-4
    swivel_rad: float = 0.01
    reference_m: float = 5e-4
    frame_m: float = 5e-4
    frame_rad: float = 2e-3
    clock_s: float = 5e-4
    creep_m_s: float = 1e-6
    stretch_s2_m: float = 1e-4
    gross: float = 12.0
    declared: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        for name, value in self.numbers().items():
            if not (np.isfinite(value) and value > 0.0):
                usual = type(self).__dataclass_fields__[name].default
                raise ValueError(
                    f"tolerances: {name} is {value}, must be above 0; leave it out for {usual:g}"
                )
        if not self.gross > 1.0:
            raise ValueError(
                f"tolerances: gross is {self.gross:g}, must be above 1: an error is larger than "
                "a tolerance"
            )

    def numbers(self) -> dict[str, float]:
        """All of them by name."""
        return {one.name: getattr(self, one.name) for one in fields(self) if one.name != "declared"}
