"""The platform's tags in recordings of swings: at any instant all cameras see one rigid body.

Found and fitted as a board's tags are; the body they make is not flat, and its corners are those of
target.toml. Cameras that never see a board together are tied by it (`calib.rig.tie_by_swings`).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.board_corners import (
    LEAST_STD_PX,
    BoardCorners,
    Image,
    fitted_corners,
    tag_detector,
)
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.tags.base_tags import SURVEY_STD_M
from freeswing.calib.tags.corners import rimmed_cells
from freeswing.calib.tags.tag_patterns import cut_dictionary
from freeswing.cdpr.measured.target import Target

LEAST_TAGS = 2
"""One tag's pose is told by its foreshortening alone, which noise turns over."""


@dataclass(frozen=True, slots=True)
class PlatformTags:
    """The tags as one body.

    Attributes:
        names: family and id of each tag.
        corners_m: TL TR BR BL of each, platform frame, row by row, (n_tags, 12).
        std_m: how far each may be from there, each axis, one standard deviation, (n_tags,).
    """

    names: tuple[tuple[str, int], ...]
    corners_m: tuple[tuple[float, ...], ...]
    std_m: tuple[float, ...] = field(repr=False)  # what is kept of detections goes by the others

    @property
    def points_m(self) -> Array:
        """Corners, (4 n_tags, 3)."""
        return np.array(self.corners_m, dtype=np.float64).reshape(-1, 3)


def platform_tags(target: Target) -> PlatformTags | None:
    """The tags of a target, None where there are too few to tell a pose."""
    if len(target.tags) < LEAST_TAGS:
        return None
    return PlatformTags(
        tuple((tag.family, tag.id) for tag in target.tags),
        tuple(tuple(np.ravel(tag.corners_platform_m).tolist()) for tag in target.tags),
        tuple(SURVEY_STD_M if tag.std_m is None else tag.std_m for tag in target.tags),
    )


@dataclass(slots=True)
class PlatformDetector:
    """Finds the platform's tags in one image after the other, as `BoardDetector` does a board.

    Attributes:
        board: the tags.
    """

    board: PlatformTags
    _families: list[tuple[str, tuple[int, ...], cv2.aruco.ArucoDetector]] = field(
        init=False, repr=False
    )

    def __post_init__(self) -> None:
        self._families = []
        for family in sorted({name for name, _ in self.board.names}):
            ids = tuple(number for name, number in self.board.names if name == family)
            self._families.append((family, ids, tag_detector(cut_dictionary(family, ids), 1)))

    @property
    def border_cells(self) -> int:
        """Width of the tags' border."""
        return 1

    @property
    def other_board(self) -> str | None:
        """Nothing else is looked for."""
        return None

    @property
    def state(self) -> NDArray[np.int64]:
        """It learns nothing."""
        return np.zeros(1, dtype=np.int64)

    def knows(self, state: NDArray[np.int64]) -> bool:
        """Whether that is its state."""
        return state.tolist() == [0]

    def restore(self, state: NDArray[np.int64]) -> None:
        """Nothing to take up."""

    def nothing(self) -> BoardCorners:
        """No corner at all."""
        count = len(self.board.names)
        return BoardCorners(np.full((4 * count, 2), np.nan), np.full((count, 8, 8), np.nan))

    def detect(self, image: Image) -> BoardCorners | None:
        """Corners of the tags with their covariance; None where fewer than two are seen."""
        found = self.nothing()
        for family, ids, detector in self._families:
            quads, places, _ = detector.detectMarkers(image)
            places = [] if places is None else np.ravel(places).tolist()
            for quad, place in zip(quads, places, strict=True):
                number = ids[int(place)]
                fit = fitted_corners(
                    image,
                    np.reshape(quad, (4, 2)).astype(np.float64),
                    rimmed_cells(family, number),
                )
                if fit is not None:
                    at = self.board.names.index((family, number))
                    found.pixels[4 * at : 4 * at + 4] = fit.rays
                    noise = LEAST_STD_PX**2 * np.eye(8)
                    found.covariance_px2[at] = fit.rays_covariance + noise
        return found if found.count >= 4 * LEAST_TAGS else None
