"""What a session says of the laboratory: its images, and what was measured in it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from freeswing.calib.scene.tape_measured import Distance, SurveyedPoint


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
