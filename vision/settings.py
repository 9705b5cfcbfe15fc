"""How to track: what a user may choose."""

from __future__ import annotations

from dataclasses import dataclass

from freeswing.calib.tags.base_tags import SURVEY_STD_M


@dataclass(frozen=True, slots=True)
class Settings:
    """How to track.

    Attributes:
        correct_rig: look for late clocks, rolling shutters and moved cameras, and remove them.
        refine_layout: fit the tags' places on the platform to the recordings.
        survey_std_m: standard deviation of the base tags' corners.
    """

    correct_rig: bool = True
    refine_layout: bool = False
    survey_std_m: float = SURVEY_STD_M
