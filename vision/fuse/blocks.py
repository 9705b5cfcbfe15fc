"""A run's sightings of all cameras, block by block in base time, so that memory stays flat."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.rotation import invert
from freeswing.vision.fuse.corner_noise import outwards
from freeswing.vision.fuse.linearised_block import linearised
from freeswing.vision.fuse.motion.motion_from_poses import Course
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.rolling_shutter import rolling_bias
from freeswing.vision.fuse.run_views import Block, CameraViews
from freeswing.vision.look.follow import USED
from freeswing.vision.look.pieces import Piece
from freeswing.vision.look.watched_target import Watch

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

INSTANTS_A_BLOCK = 400


def blocks(
    views: Sequence[CameraViews],
    watch: Watch,
    instants_s: Array,
    poses: Poses | None = None,
    *,
    pixels_alone: bool = False,
) -> Iterator[Block]:
    """All sightings of the platform, each at the instant nearest to its frame; see `RunBlocks`."""
    return RunBlocks(views, watch, instants_s, pixels_alone=pixels_alone).at(poses)


class RunBlocks:
    """A run's sightings for any number of passes; where all are one block it is made once.

    With `pixels_alone` their covariances hold nothing of what is not known of a motion.
    """

    def __init__(
        self,
        views: Sequence[CameraViews],
        watch: Watch,
        instants_s: Array,
        *,
        pixels_alone: bool = False,
    ) -> None:
        self.views, self.watch, self.instants_s = views, watch, instants_s
        self.pixels_alone = pixels_alone
        self._only: Block | None = None

    def at(self, poses: Poses | None) -> Iterator[Block]:
        """All sightings of the platform, each at the instant nearest to its frame.

        With poses at these instants, each sighting has the platform's motion from its instant on,
        what is not known of that among its covariance, and corners freed of what rolling shutters
        did.
        """
        for block in self._plain():
            if poses is None or poses.course is None:
                yield block
            else:
                alone = self.pixels_alone
                yield _carried(block, self.views, poses, poses.course, pixels_alone=alone)

    def _plain(self) -> Iterator[Block]:
        """The blocks as they were seen."""
        if self._only is not None:
            yield self._only
            return
        nearest = [_nearest(v, self.instants_s) for v in self.views]
        count = len(self.instants_s)
        for first in range(0, count, INSTANTS_A_BLOCK):
            last = min(first + INSTANTS_A_BLOCK, count)
            block = _block(self.views, nearest, self.watch, first, last)
            if count <= INSTANTS_A_BLOCK:
                self._only = block
            yield block


def _carried(
    block: Block, views: Sequence[CameraViews], poses: Poses, course: Course, *, pixels_alone: bool
) -> Block:
    """The block with the platform's motion from each instant to its sightings."""
    instant = np.repeat(np.arange(len(block.starts) - 1), np.diff(block.starts))
    at = block.first + instant
    found = course.carried(at, block.sighted_s() - poses.times_s[at])
    if pixels_alone:
        found = found._replace(variances=np.zeros_like(found.variances))
    block = replace(block, shifts=found.shifts, motions=found.motions)
    if not found.variances.any() and not any(v.camera.line_time_s for v in views):
        return block  # all was seen at the instants, each image at once
    linear = linearised(block, views, poses)
    # All that a camera saw at once was carried alike: each counts as one of so many.
    _, own, alike = np.unique(
        instant * len(views) + block.camera_of, return_inverse=True, return_counts=True
    )
    by_pose = linear.jacobians * np.sqrt(alike[own, None] * found.variances)[:, None]
    return replace(
        block,
        rays=block.rays - rolling_bias(block, views, linear),
        covariances=block.covariances + by_pose @ np.swapaxes(by_pose, 1, 2),
    )


def _nearest(views: CameraViews, instants_s: Array) -> Ints:
    """Instant of each frame, -1 when it is farther than 0.6 steps or was not used."""
    times = views.middle_times()
    if len(instants_s) == 0:
        return np.full(len(times), -1, dtype=np.int64)
    if len(instants_s) == 1:
        place = np.zeros(len(times), dtype=np.int64)
        return np.where(views.status == USED, place, -1)
    step = float(np.median(np.diff(instants_s)))
    safe = np.where(np.isfinite(times), times, -np.inf)
    right = np.clip(np.searchsorted(instants_s, safe), 1, len(instants_s) - 1)
    place = np.where(safe - instants_s[right - 1] < instants_s[right] - safe, right - 1, right)
    near = np.abs(safe - instants_s[place]) < 0.6 * step
    return np.where(near & (views.status == USED), place, -1)


def _block(
    views: Sequence[CameraViews], nearest: Sequence[Ints], watch: Watch, first: int, last: int
) -> Block:
    parts: list[tuple[NDArray, ...]] = []
    guesses = np.full((last - first, 4, 4), np.nan)
    most = np.zeros(last - first)
    for index, (view, place) in enumerate(zip(views, nearest, strict=True)):
        frames = np.flatnonzero((place >= first) & (place < last))
        T_base_camera = invert(view.camera.T_camera_base)
        for low, first_sighting, piece, mask in view.rows(frames):
            own = place[low : low + len(mask)] - first
            _take_guesses(piece, mask, own, T_base_camera, watch, guesses, most)
            keep = mask[piece.frame_of] & _on_platform(piece.things, watch)
            frame_of = piece.frame_of[keep]
            stamps = piece.stamps_s[frame_of] + view.camera.clock_offset_s
            rows = piece.rows_px[keep]
            parts.append(
                (
                    own[frame_of],
                    np.full(len(frame_of), index),
                    piece.things[keep],
                    piece.rays[keep],
                    piece.covariances[keep],
                    stamps[:, None] + view.camera.line_time_s * rows,
                    rows,
                    piece.numbers[frame_of],
                    first_sighting + np.flatnonzero(keep),
                )
            )
    if not parts:
        parts = [tuple(np.zeros((0, *s)) for s in ((), (), (), (8,), (8, 8), (4,), (4,), (), ()))]
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    order = np.lexsort((columns[2], columns[1], columns[0]))
    instant, camera_of, things, rays, covariances, times, rows, frames, index = (
        column[order] for column in columns
    )
    things = things.astype(np.int64)
    starts = np.searchsorted(instant, np.arange(last - first + 1))
    counts = np.where((things >= 0) & (things < watch.first_base), 4, 1)
    growths = np.array([view.growth_px / view.camera.focal_px.mean() for view in views])
    grown = (counts == 4) & (growths[camera_of.astype(np.int64)] != 0.0)
    own = growths[camera_of[grown].astype(np.int64)]
    rays[grown] -= own[:, None] * outwards(rays[grown])
    return Block(
        first,
        starts.astype(np.int64),
        camera_of.astype(np.int64),
        things,
        counts.astype(np.int64),
        points_of(things, watch),
        np.ascontiguousarray(rays),
        np.ascontiguousarray(covariances),
        times,
        rows,
        frames.astype(np.int64),
        index.astype(np.int64),
        guesses,
        np.zeros((len(things), 6)),
        np.zeros((len(things), 12)),
    )


def points_of(things: Ints, watch: Watch) -> Array:
    """Platform points of sightings, (n_o, 4, 3); a marker fills the first row only."""
    points = np.zeros((len(things), 4, 3))
    tags = (things >= 0) & (things < watch.first_base)
    points[tags] = watch.tag_corners_m[things[tags]]
    markers = things >= watch.first_marker
    points[markers, 0] = watch.marker_positions_m[things[markers] - watch.first_marker]
    return points


def _on_platform(things: Ints, watch: Watch) -> NDArray[np.bool_]:
    return np.asarray((things < watch.first_base) | (things >= watch.first_marker))


def _take_guesses(
    piece: Piece,
    mask: NDArray[np.bool_],
    own: Ints,
    T_base_camera: Array,
    watch: Watch,
    guesses: Array,
    most: Array,
) -> None:
    """Keeps, for each instant, the pose of the camera that sees most of the platform."""
    seen = np.bincount(
        piece.frame_of[_on_platform(piece.things, watch)], minlength=len(piece.numbers)
    )
    for row in np.flatnonzero(mask & np.isfinite(piece.poses[:, 0])):
        if seen[row] > most[own[row]]:
            most[own[row]] = seen[row]
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = piece.poses[row, :9].reshape(3, 3), piece.poses[row, 9:]
            guesses[own[row]] = T_base_camera @ pose
