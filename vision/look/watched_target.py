"""What tracking looks for: the platform's tags and markers, and tags that stand in the base."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.tags.base_tags import SurveyedTag
from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.measured.target import Target
from freeswing.vision.look.detect import TagKey

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Watch:
    """Things to look for; an observation names its thing by the index over all three lists.

    Attributes:
        tags: (family, id) of the platform's tags.
        tag_corners_m: their corners, platform frame, (n, 4, 3).
        base_tags: (family, id) of the tags in the base.
        base_corners_m: their corners, base frame, (m, 4, 3).
        markers: names of round markers.
        marker_positions_m: platform frame, (k, 3).
        marker_diameters_m: (k,), 0 when unknown.
        named: whether sightings of markers say which they are, as matched features do.
        base_std_m: stated deviations of the base tags' coordinates, NaN where none is; (m,), or
            none at all (0,).
    """

    tags: tuple[TagKey, ...]
    tag_corners_m: Array
    base_tags: tuple[TagKey, ...]
    base_corners_m: Array
    markers: tuple[str, ...]
    marker_positions_m: Array
    marker_diameters_m: Array
    named: bool = False
    base_std_m: Array = field(default_factory=lambda: np.zeros(0))

    @staticmethod
    def of(target: Target, base_tags: Iterable[SurveyedTag] = ()) -> Watch:
        """From target.toml and the surveyed tags.

        Raises:
            InputError: when a tag is claimed both by the platform and by the base.
        """
        standing = tuple(base_tags)
        tags = tuple((tag.family, tag.id) for tag in target.tags)
        base = tuple((tag.family, tag.id) for tag in standing)
        both = sorted(set(tags) & set(base))
        if both:
            raise InputError(
                f"tag {both[0][0]} {both[0][1]} is both on the platform (target.toml) and in the "
                "base (base_tags); give one of them another id"
            )
        return Watch(
            tags,
            np.array([tag.corners_platform_m for tag in target.tags]).reshape(-1, 4, 3),
            base,
            np.array([tag.corners_base_m for tag in standing]).reshape(-1, 4, 3),
            target.marker_names,
            target.marker_positions_m,
            np.array([marker.diameter_m or 0.0 for marker in target.markers]),
            base_std_m=np.array([np.nan if t.std_m is None else t.std_m for t in standing]),
        )

    @property
    def first_base(self) -> int:
        """Index of the first base tag."""
        return len(self.tags)

    @property
    def first_marker(self) -> int:
        """Index of the first marker."""
        return len(self.tags) + len(self.base_tags)

    @property
    def platform_points(self) -> int:
        """Points on the platform that can be seen."""
        return 4 * len(self.tags) + len(self.markers)

    def name(self, thing: int) -> str:
        """A thing's name for messages."""
        if thing < 0:
            return "unlabelled marker"
        if thing < self.first_base:
            return f"{self.tags[thing][0]} {self.tags[thing][1]}"
        if thing < self.first_marker:
            family, number = self.base_tags[thing - self.first_base]
            return f"{family} {number}"
        return f"marker {self.markers[thing - self.first_marker]}"
