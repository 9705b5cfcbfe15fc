"""What was measured in the base frame: surveyed tags, and points that a person marked."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.sightings import Sightings
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.scene.clicked_points import Click, clicked, joined
from freeswing.calib.scene.tape_measured import SurveyedPoint
from freeswing.calib.tags.base_tags import (
    SURVEY_STD_M,
    SurveyedTag,
    TagSightings,
    find_base_tags,
)


@dataclass(frozen=True, slots=True)
class Survey:
    """What was measured in the base frame: tags, and points with where they were marked.

    Attributes:
        tags: surveyed tags.
        std_m: deviation of the coordinates of tags that state none.
        points: surveyed points.
        clicks: marks of these.
    """

    tags: tuple[SurveyedTag, ...] = ()
    std_m: float = SURVEY_STD_M
    points: tuple[SurveyedPoint, ...] = ()
    clicks: tuple[Click, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.tags or self.points)

    def seen(
        self, cameras: tuple[Camera, ...], sightings: tuple[Sightings, ...], sigma_px: Array
    ) -> TagSightings:
        """Tags in the still frames, and points where they were marked."""
        marked = clicked(cameras, sigma_px, self.points, self.clicks)
        if not self.tags:
            return TagSightings(marked, ())
        stills = [camera.still_frames for camera in sightings]
        tags = find_base_tags(cameras, stills, self.tags, sigma_px, self.std_m)
        return replace(tags, fixed=joined(tags.fixed, marked))

    def unstated(self, measured: bool) -> NDArray[np.bool_]:
        """Which corners and points have a deviation that the fit is to tell, (n,)."""
        of_tags = np.array([tag.std_m is None and measured for tag in self.tags], dtype=bool)
        return np.concatenate([np.repeat(of_tags, 4), np.zeros(len(self.points), dtype=bool)])
