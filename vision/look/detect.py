"""Tags found anywhere in an image: OpenCV's quads, then the pattern fit for their corners."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.calib.tags.corner_kernels import Rays
from freeswing.calib.tags.corners import FIRST_BLURS_PX, TagFit, fit_tag, rimmed_cells
from freeswing.calib.tags.tag_patterns import cut_dictionary

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
TagKey = tuple[str, int]

_THRESHOLD_WINDOW = 23  # px: one pass instead of three; tags of 20 to 400 px are found alike
_LEAST_PERIMETER_RATE = 0.02  # of the image: smaller ones cannot be read in usual pictures


@dataclass(frozen=True, slots=True)
class Quad:
    """A tag as OpenCV finds it, within a pixel or two: corners TL TR BR BL in pixels, (4, 2)."""

    family: str
    id: int
    corners_px: Array


@dataclass(frozen=True, slots=True)
class TagFinder:
    """Looks for the given tags; dictionaries are cut to the ids in use, which halves the time."""

    ids: tuple[tuple[str, tuple[int, ...]], ...]
    detectors: tuple[cv2.aruco.ArucoDetector, ...]

    @staticmethod
    def of(tags: Iterable[TagKey]) -> TagFinder:
        """A finder of these (family, id) pairs, several families at once."""
        by_family: dict[str, list[int]] = {}
        for family, tag_id in sorted(set(tags)):
            by_family.setdefault(family, []).append(tag_id)
        ids = tuple((family, tuple(numbers)) for family, numbers in by_family.items())
        parameters = cv2.aruco.DetectorParameters()
        parameters.adaptiveThreshWinSizeMin = _THRESHOLD_WINDOW
        parameters.adaptiveThreshWinSizeMax = _THRESHOLD_WINDOW
        parameters.minMarkerPerimeterRate = _LEAST_PERIMETER_RATE
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
        detectors = tuple(
            cv2.aruco.ArucoDetector(cut_dictionary(family, numbers), parameters)
            for family, numbers in ids
        )
        return TagFinder(ids, detectors)

    def quads(self, image: Image) -> list[Quad]:
        """Every known tag in the image; one seen twice is left out, since one must be misread."""
        found: dict[TagKey, list[Quad]] = {}
        for (family, numbers), detector in zip(self.ids, self.detectors, strict=True):
            corners, places, _ = detector.detectMarkers(image)
            if places is None:
                continue
            for quad, place in zip(corners, np.ravel(places), strict=True):
                tag_id = numbers[int(place)]
                corners_px = np.asarray(quad, dtype=np.float64).reshape(4, 2)
                found.setdefault((family, tag_id), []).append(Quad(family, tag_id, corners_px))
        return [quads[0] for quads in found.values() if len(quads) == 1]


def detect_tags(
    image: Image, camera: Camera, rays: Rays, tags: Sequence[TagKey], finder: TagFinder
) -> dict[TagKey, TagFit]:
    """Tags in the whole image with fitted corners; what does not fit its pattern is left out.

    Args:
        image: grey, (h, w).
        camera: its lens.
        rays: `lens_rays(camera)`.
        tags: those wanted.
        finder: made of at least these tags.
    """
    wanted = set(tags)
    found: dict[TagKey, TagFit] = {}
    for quad in finder.quads(image):
        key = (quad.family, quad.id)
        if key not in wanted:
            continue
        guess = camera.normalise(quad.corners_px)
        cells = rimmed_cells(quad.family, quad.id)
        fit = fit_tag(image, rays, guess, quad.corners_px, cells, blurs_px=FIRST_BLURS_PX)
        if fit is not None:
            found[key] = fit
    return found
