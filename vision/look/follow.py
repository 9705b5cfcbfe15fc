"""Follows the platform through one camera's frames: predict, look there, search only when lost.

The prediction is the motion of the last frames, carried on with constant acceleration in the
camera's own frame; it gives each tag's place within a fraction of a pixel. A tag counts only when
its whole pattern fits, so that a wrong or half-hidden tag is refused there and then.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera import lens_models
from freeswing.calib.camera.camera import Camera
from freeswing.calib.tags.corner_kernels import Rays
from freeswing.calib.tags.corners import (
    FIRST_BLURS_PX,
    TagFit,
    fit_predicted,
    fit_tag,
    lens_rays,
    rimmed_cells,
)
from freeswing.vision.look.detect import TagFinder, detect_tags
from freeswing.vision.look.lighting import is_covered, is_overexposed, is_saturated
from freeswing.vision.look.marker_blobs import Blob, find_blobs
from freeswing.vision.look.near_kernels import expected_tags
from freeswing.vision.look.occlusion import Plates
from freeswing.vision.look.single_pose import Pose, extrapolate, refine_pose, start_pose
from freeswing.vision.look.watched_target import Watch

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]

Look = tuple[float, float, float, float]
"""Black, contrast, blur in px and noise of a tag when it was last seen."""

MOST_PIXELS = 2500

USED, NOTHING, COVERED, OVEREXPOSED, REPEATED, UNSTAMPED = range(6)
STATUS_NAMES = (
    "used",
    "nothing found",
    "lens covered",
    "over-exposed",
    "repeated frame",
    "no time stamp",
)

_BASE_EVERY = 40  # frames: cameras are knocked once, not forty times a second
_SEARCH_EVERY = 10  # frames: searches of the whole image are slow
_EAGER_SEARCHES = 5  # a platform that was hidden for a moment comes back at once
_FACING = 0.25  # cosine: a tag seen from 75 degrees is a few pixels wide
_KEPT_POSES = 3


@dataclass(frozen=True, slots=True)
class Sighting:
    """One thing in one frame: its index in the `Watch` (-1 unlabelled), rays and covariance."""

    thing: int
    rays: Array
    covariance: Array
    rows_px: Array
    blur_px: float
    noise: float


@dataclass(frozen=True, slots=True)
class FrameView:
    """What one frame gave."""

    status: int
    sightings: tuple[Sighting, ...]
    pose: Pose | None


@dataclass(slots=True)
class Follower:
    """One camera's tracker; `look` takes the frames in order."""

    camera: Camera
    watch: Watch
    past: list[tuple[float, Pose]] = field(default_factory=list)
    base_rays: dict[int, Array] = field(default_factory=dict)
    before: dict[int, Look] = field(default_factory=dict)
    misses: int = 0
    count: int = 0
    _rays: Rays = field(init=False, repr=False)
    _finder: TagFinder = field(init=False, repr=False)
    _cells: list[tuple[NDArray[np.int64], Array]] = field(init=False, repr=False)
    _plates: Plates = field(init=False, repr=False)
    _lens: tuple[bool, Array, Array] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._rays = lens_rays(self.camera)
        self._lens = _lens_numbers(self.camera)
        patterns = [rimmed_cells(family, number) for family, number in self.watch.tags]
        self._cells = _by_size(patterns)
        counts = np.array([len(cells) - 2 for cells in patterns], dtype=float)
        self._plates = Plates.of(self.watch.tag_corners_m, counts)
        self._finder = TagFinder.of((*self.watch.tags, *self.watch.base_tags))

    def look(self, image: Image, time_s: float) -> FrameView:
        """Everything known in the image taken at `time_s` by the camera's clock."""
        found: dict[int, TagFit] = {}
        if self.past and time_s <= self.past[-1][0]:
            self.past.clear()  # a clock that went back predicts nothing
        predicted = extrapolate(self.past, time_s)
        if self.watch.tags:
            if predicted is not None:
                found = self._look_near(image, predicted)
            if not found and self._may_search():
                found = self._search(image)
        if self.count % _BASE_EVERY == 0 and self.watch.base_tags:
            found |= self._look_at_base(image)
        self.count += 1
        bright = {k for k, fit in found.items() if is_saturated(fit.black + fit.contrast)}
        kept = {k: fit for k, fit in found.items() if k not in bright}
        pose = self._settle(kept, time_s, predicted)
        if pose is not None:
            covered = self._plates.hidden(*pose)
            kept = {k: fit for k, fit in kept.items() if k >= len(covered) or not covered[k]}
        sightings = self._sightings(kept)
        sightings += self._look_for_markers(image, pose)
        return FrameView(self._status(image, sightings, bright), tuple(sightings), pose)

    def _may_search(self) -> bool:
        return self.misses < _EAGER_SEARCHES or self.misses % _SEARCH_EVERY == 0

    def _look_near(self, image: Image, pose: Pose) -> dict[int, TagFit]:
        seen, guesses = expected_tags(
            self.watch.tag_corners_m, pose[0], pose[1], *self._lens, _FACING
        )
        seen &= ~self._plates.hidden(*pose)
        found: dict[int, TagFit | None] = {}
        if len(self.past) >= _KEPT_POSES:
            found = self._fit_predicted(image, seen, guesses)
        for k in np.flatnonzero(seen).tolist():
            if k not in found:
                found[k] = self._fit(image, k, guesses[k, 0], guesses[k, 1], near=False)
        return {k: fit for k, fit in found.items() if fit is not None}

    def _fit_predicted(self, image: Image, seen: Mask, guesses: Array) -> dict[int, TagFit | None]:
        """Tags that were seen in the frame before, those with as many cells at one call."""
        found: dict[int, TagFit | None] = {}
        for places, cells in self._cells:
            things = [k for k in self.before if k < len(seen) and seen[k] and places[k] >= 0]
            if not things:
                continue
            before = np.array([self.before[k] for k in things])
            patterns = cells[places[things]]
            fits = fit_predicted(
                image, self._rays, guesses[things], patterns, before, most_pixels=MOST_PIXELS
            )
            found |= zip(things, fits, strict=True)
        for thing, fit in found.items():
            self._remember(thing, fit)
        return found

    def _fit(
        self, image: Image, thing: int, guess: Array, guess_px: Array, *, near: bool
    ) -> TagFit | None:
        family, tag_id = (*self.watch.tags, *self.watch.base_tags)[thing]
        before = self.before.get(thing) if near else None
        fit = fit_tag(
            image,
            self._rays,
            guess,
            guess_px,
            rimmed_cells(family, tag_id),
            blurs_px=FIRST_BLURS_PX if before is None else (before[2],),
            most_pixels=MOST_PIXELS,
            before=before,
        )
        self._remember(thing, fit)
        return fit

    def _remember(self, thing: int, fit: TagFit | None) -> None:
        if fit is None:
            self.before.pop(thing, None)
        else:
            self.before[thing] = (fit.black, fit.contrast, fit.blur_px, fit.noise)

    def _search(self, image: Image) -> dict[int, TagFit]:
        names = self.watch.tags
        fits = detect_tags(image, self.camera, self._rays, names, self._finder)
        return {names.index(key): fit for key, fit in fits.items()}

    def _look_at_base(self, image: Image) -> dict[int, TagFit]:
        """Base tags where they were last; a search of the whole image the first time."""
        names, first = self.watch.base_tags, self.watch.first_base
        if not self.base_rays:
            fits = detect_tags(image, self.camera, self._rays, names, self._finder)
            found = {first + names.index(key): fit for key, fit in fits.items()}
        else:
            found = {}
            for thing, rays in self.base_rays.items():
                pixels = self.camera.project(np.column_stack([rays, np.ones(4)]))
                fit = self._fit(image, thing, rays, pixels, near=True)
                if fit is not None:
                    found[thing] = fit
        for thing, fit in found.items():
            self.base_rays[thing] = fit.rays
        return found

    def _settle(
        self, found: dict[int, TagFit], time_s: float, predicted: Pose | None
    ) -> Pose | None:
        """The pose of this frame, which also feeds the next prediction."""
        mine = [k for k in sorted(found) if k < self.watch.first_base]
        if not mine:
            self.misses += 1
            if self.misses > 2:
                self.past.clear()
            return None
        self.misses = 0
        points = self.watch.tag_corners_m[mine]
        rays = np.array([found[k].rays.ravel() for k in mine])
        start = predicted or start_pose(points, rays)
        covariances = np.array([found[k].rays_covariance for k in mine])
        pose = None if start is None else refine_pose(start, points, rays, covariances)
        if pose is None:
            self.past.clear()
            return None
        self.past = [*self.past, (time_s, pose)][-_KEPT_POSES:]
        return pose

    def _sightings(self, found: dict[int, TagFit]) -> list[Sighting]:
        if not found:
            return []
        things = sorted(found)
        rays = np.ones((len(things), 4, 3))
        rays[:, :, :2] = [found[k].rays for k in things]
        rows = self.camera.project(rays)[:, :, 1]
        return [
            Sighting(k, fit.rays.ravel(), fit.rays_covariance, own, fit.blur_px, fit.noise)
            for k, fit, own in zip(things, (found[k] for k in things), rows, strict=True)
        ]

    def _look_for_markers(self, image: Image, pose: Pose | None) -> list[Sighting]:
        if not self.watch.markers:
            return []
        near = None
        if pose is not None:
            places = self.watch.marker_positions_m @ pose[0].T + pose[1]
            near = self.camera.project(places[self.camera.sees(places)])
        return [_blob_sighting(blob) for blob in find_blobs(image, self.camera, near)]

    def _status(self, image: Image, sightings: list[Sighting], bright: set[int]) -> int:
        if any(s.thing < self.watch.first_base or s.thing < 0 for s in sightings):
            return USED
        if any(s.thing >= self.watch.first_marker for s in sightings):
            return USED
        coarse = image[::8, ::8]
        if bright or is_overexposed(coarse):
            return OVEREXPOSED
        if is_covered(coarse):
            return COVERED
        return NOTHING


def _by_size(patterns: list[Array]) -> list[tuple[NDArray[np.int64], Array]]:
    """For each size of patterns: which place of the row each has, -1 for others, and the row."""
    sizes = np.array([len(cells) for cells in patterns], dtype=np.int64)
    rows = []
    for size in np.unique(sizes):
        mine = sizes == size
        places = np.where(mine, np.cumsum(mine) - 1, -1)
        rows.append((places, np.array([patterns[k] for k in np.flatnonzero(mine)])))
    return rows


def _lens_numbers(camera: Camera) -> tuple[bool, Array, Array]:
    """What `expected_tags` wants of a camera."""
    model, params = camera.model, camera.params
    view = np.array([lens_models.radius_limit(model, params), *camera.size_px], dtype=np.float64)
    return model == lens_models.FISHEYE, lens_models.full_parameters(model, params), view


def _blob_sighting(blob: Blob) -> Sighting:
    rays, covariance = np.zeros(8), np.zeros((8, 8))
    rays[:2], covariance[:2, :2] = blob.ray, blob.covariance
    rows = np.full(4, blob.centre_px[1])
    return Sighting(-1, rays, covariance, rows, 0.0, blob.noise)
