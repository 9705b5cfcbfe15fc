"""What a person measured in the laboratory: places of points, distances of two."""

from __future__ import annotations

from dataclasses import dataclass

from freeswing.calib.camera.lens_models import Array

TAPE_STD_M = 0.001  # of what a tape measure gives


@dataclass(frozen=True, slots=True)
class SurveyedPoint:
    """A point of the laboratory whose place in the base frame was measured, (3,)."""

    name: str
    position_base_m: Array
    std_m: float = TAPE_STD_M


@dataclass(frozen=True, slots=True)
class Distance:
    """A measured distance of two marked points."""

    between: tuple[str, str]
    distance_m: float
    std_m: float = TAPE_STD_M
