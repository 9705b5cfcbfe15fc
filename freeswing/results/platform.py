"""results/platform.json: the identified platform in kg and m."""

from __future__ import annotations

from typing import ClassVar

from freeswing.results.codec import Document, Numbers, entry


@entry
class Platform(Document):
    """Mass, centre of mass in the platform frame, inertia tensor about it."""

    kind: ClassVar[str] = "platform"

    robot: str = ""
    mass_kg: float
    com_m: Numbers
    inertia_about_com_kg_m2: tuple[Numbers, ...]
