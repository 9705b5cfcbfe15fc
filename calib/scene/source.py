"""What a session says of the laboratory: its images, and what was measured in it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

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


@dataclass(frozen=True, slots=True)
class SceneSource:
    """What the laboratory is known by.

    Attributes:
        frames: folder with a recording of each camera of the rig, nothing moving.
        walk: stills or a video of one camera that is carried through, or None.
        clicks: table of points marked in these images, or None.
        surveyed: points whose places were measured.
        distances: measured between marked points.
    """

    frames: Path
    walk: Path | None = None
    clicks: Path | None = None
    surveyed: tuple[SurveyedPoint, ...] = ()
    distances: tuple[Distance, ...] = ()

    @property
    def files(self) -> list[Path]:
        """Everything that a calibration reads."""
        return [path for path in (self.frames, self.walk, self.clicks) if path is not None]
