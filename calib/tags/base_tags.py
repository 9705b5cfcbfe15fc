"""Surveyed tags fixed to the frame: found in still frames, they tie the cameras to the base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

from freeswing.calib.board.board_corners import LEAST_STD_PX, Image
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.views import FixedPoints
from freeswing.calib.tags.corners import fit_tag, rimmed_cells, to_pixels
from freeswing.calib.tags.tag_patterns import cut_dictionary

SURVEY_STD_M = 0.0003  # of a coordinate by total station, where the user states none
CORNER_NAMES = ("TL", "TR", "BR", "BL")
_SAME_PLACE_PX = 1.0  # tens of deviations of a corner: beyond it something has moved
_MARGIN = 0.4  # of a tag; the fit reads 0.19 to 0.25 beyond it


class SurveyedTag(Protocol):
    """What a surveyed tag has to have: family, id and corners TL TR BR BL, (4, 3).

    `std_m` is the stated deviation of its coordinates, None where none is.
    """

    @property
    def family(self) -> str: ...  # noqa: D102
    @property
    def id(self) -> int: ...  # noqa: D102
    @property
    def corners_base_m(self) -> Array: ...  # noqa: D102
    @property
    def std_m(self) -> float | None: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class TagSightings:
    """Surveyed tags as all cameras see them.

    Attributes:
        fixed: corners, survey and sightings.
        moved: cameras whose tags moved between the still frames, with the distance in pixels.
    """

    fixed: FixedPoints
    moved: tuple[tuple[str, float], ...]


def find_base_tags(
    cameras: tuple[Camera, ...],
    stills: Sequence[Sequence[Image]],
    tags: Sequence[SurveyedTag],
    sigma_px: Array,
    survey_std_m: float = SURVEY_STD_M,
) -> TagSightings:
    """Corners of the surveyed tags in every camera, each the median over the still frames.

    Args:
        cameras: lenses known.
        stills: frames of every camera, during which camera and tags stood still.
        tags: the survey.
        sigma_px: noise of one board corner in each camera.
        survey_std_m: standard deviation of a surveyed coordinate where the tag states none.
    """
    camera_rows, point_rows, pixels, scales, moved = [], [], [], [], []
    for index, camera in enumerate(cameras):
        seen = _tags_of_camera(camera, stills[index], tags)
        drift = 0.0
        for number, fits in sorted(seen.items()):
            corners = np.array([corners for corners, _ in fits])
            middle = np.median(corners, axis=0)
            near = np.linalg.norm(corners - middle, axis=-1).max(axis=1) < _SAME_PLACE_PX
            drift = max(drift, float(np.linalg.norm(corners[-1] - corners[0], axis=-1).mean()))
            if not near.any():
                continue
            noise = np.mean([noise for (_, noise), ok in zip(fits, near, strict=True) if ok])
            std = np.hypot(noise / np.sqrt(near.sum()), LEAST_STD_PX)
            camera_rows += [index] * 4
            point_rows += range(4 * number, 4 * number + 4)
            pixels.append(corners[near].mean(axis=0))
            scales += [std / sigma_px[index]] * 4
        if drift > _SAME_PLACE_PX:
            moved.append((camera.name, drift))
    names = [f"{tag.family}:{tag.id} {corner}" for tag in tags for corner in CORNER_NAMES]
    fixed = FixedPoints(
        tuple(names),
        np.concatenate([np.asarray(tag.corners_base_m, dtype=float) for tag in tags]),
        np.repeat([survey_std_m if tag.std_m is None else tag.std_m for tag in tags], 4),
        np.array(camera_rows, dtype=int),
        np.array(point_rows, dtype=int),
        np.concatenate(pixels) if pixels else np.zeros((0, 2)),
        np.array(scales, dtype=float),
    )
    return TagSightings(fixed, tuple(moved))


def _tags_of_camera(
    camera: Camera, stills: Sequence[Image], tags: Sequence[SurveyedTag]
) -> dict[int, list[tuple[Array, float]]]:
    """Corners (4, 2) and their noise in every still, by the tag's place in the survey."""
    found: dict[int, list[tuple[Array, float]]] = {}
    for family in sorted({tag.family for tag in tags}):
        numbers = [number for number, tag in enumerate(tags) if tag.family == family]
        ids = tuple(tags[number].id for number in numbers)
        parameters = cv2.aruco.DetectorParameters()
        parameters.minMarkerPerimeterRate = 0.01
        detector = cv2.aruco.ArucoDetector(cut_dictionary(family, ids), parameters)
        for image in stills:
            quads, places, _ = detector.detectMarkers(image)
            places = np.zeros(0) if places is None else np.ravel(places)
            for quad, place in zip(quads, places, strict=True):
                tag_id = ids[int(place)]
                fit = _fitted(camera, image, np.reshape(quad, (4, 2)).astype(float), family, tag_id)
                if fit is not None:
                    found.setdefault(numbers[int(place)], []).append(fit)
    return found


def _fitted(
    camera: Camera, image: Image, quad: Array, family: str, tag_id: int
) -> tuple[Array, float] | None:
    """The tag's pattern fitted around a first guess of its corners, in a window of the image."""
    low, high = quad.min(axis=0), quad.max(axis=0)
    margin = _MARGIN * float((high - low).max()) + 6.0
    left, top = np.maximum(np.floor(low - margin), 0).astype(int)
    right, bottom = np.ceil(high + margin).astype(int) + 1
    window = np.ascontiguousarray(image[top:bottom, left:right])
    rows, columns = np.indices(window.shape)
    rays = camera.normalise(np.stack([columns + left, rows + top], axis=-1).astype(float))
    guess = camera.normalise(quad)
    if not (np.isfinite(rays).all() and np.isfinite(guess).all()):
        return None
    fit = fit_tag(
        window, rays.astype(np.float32), guess, quad - [left, top], rimmed_cells(family, tag_id)
    )
    if fit is None:
        return None
    pixels, covariance = to_pixels(camera, fit.rays, fit.rays_covariance)
    return pixels, float(np.sqrt(np.trace(covariance) / 8.0))
