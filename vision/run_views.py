"""A run's sightings of all cameras, block by block in base time, so that memory stays flat."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from calib.camera import Camera
from cdpr.rotation import invert
from vision.follow import USED
from vision.pieces import Piece, load_piece
from vision.rolling import rolling_bias
from vision.watch import Watch

if TYPE_CHECKING:
    from vision.poses import Poses

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

INSTANTS_A_BLOCK = 400


@dataclass(frozen=True, slots=True)
class Block:
    """Sightings of some instants, in order; those of instant k are starts[k] ... starts[k + 1].

    Attributes:
        first: index of the first instant.
        starts: (n_k + 1,).
        camera_of: (n_o,).
        things: index in the `Watch`, (n_o,).
        counts: points of each sighting, (n_o,).
        points: platform frame, (n_o, 4, 3).
        rays: (n_o, 8).
        covariances: of the rays, from pixel noise alone, (n_o, 8, 8).
        times_s: base time of each corner, (n_o, 4).
        rows_px: (n_o, 4).
        frames: frame number, (n_o,).
        index: place among all sightings of its camera, (n_o,).
        guesses: T_base_platform by the camera that sees most, NaN where none, (n_k, 4, 4).
    """

    first: int
    starts: Ints
    camera_of: Ints
    things: Ints
    counts: Ints
    points: Array
    rays: Array
    covariances: Array
    times_s: Array
    rows_px: Array
    frames: Ints
    index: Ints
    guesses: Array


@dataclass(slots=True)
class CameraViews:
    """One camera's pieces, read as they are needed.

    Attributes:
        camera: its lens, pose and clock as they stand.
        paths: the pieces.
        numbers: frame numbers over all pieces, (n_f,).
        stamps_s: (n_f,).
        status: (n_f,).
        labels: things that replace those of the pieces, once markers have names, (n_o,) or None.
        shrinks: factors on the rays of labelled balls, (n_o,) or None.
    """

    camera: Camera
    paths: Sequence[Path]
    numbers: Ints = field(init=False)
    stamps_s: Array = field(init=False)
    status: Ints = field(init=False)
    labels: Ints | None = field(init=False, default=None)
    shrinks: Array | None = field(init=False, default=None)
    sightings: int = field(init=False, default=0)
    _first_sighting: Ints = field(init=False)
    _bounds: Ints = field(init=False)
    _held: tuple[int, Piece] | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        numbers, stamps, status, ends, sighted = [], [], [], [0], [0]
        for path in self.paths:
            piece = load_piece(path)
            numbers.append(piece.numbers)
            stamps.append(piece.stamps_s)
            status.append(piece.status)
            ends.append(ends[-1] + len(piece.numbers))
            sighted.append(sighted[-1] + len(piece.things))
        empty = np.zeros(0)
        self.numbers = np.concatenate([empty.astype(np.int64), *numbers])
        self.stamps_s = np.concatenate([empty, *stamps])
        self.status = np.concatenate([empty.astype(np.int64), *status])
        self._bounds = np.array(ends, dtype=np.int64)
        self._first_sighting = np.array(sighted, dtype=np.int64)
        self.sightings = sighted[-1]

    def believed(self, camera: Camera) -> CameraViews:
        """The same sightings by a camera that is believed to be different."""
        copy = CameraViews(camera, ())
        copy.paths, copy.numbers, copy.stamps_s = self.paths, self.numbers, self.stamps_s
        copy.status, copy._bounds = self.status, self._bounds
        copy._first_sighting, copy.sightings = self._first_sighting, self.sightings
        copy.labels, copy.shrinks = self.labels, self.shrinks
        return copy

    def middle_times(self) -> Array:
        """Base time of each frame's middle row, (n_f,)."""
        camera = self.camera
        middle = (camera.size_px[1] - 1) / 2
        return self.stamps_s + camera.clock_offset_s + camera.line_time_s * middle

    def pieces(self) -> Iterator[tuple[int, Piece]]:
        """Every piece with the index of its first frame."""
        for k in range(len(self.paths)):
            yield int(self._bounds[k]), self._piece(k)

    def rows(self, frames: Ints) -> list[tuple[int, int, Piece, NDArray[np.bool_]]]:
        """Pieces that hold the given frames (increasing): first frame, first sighting, mask."""
        found = []
        for k in range(len(self.paths)):
            low, high = self._bounds[k], self._bounds[k + 1]
            mine = frames[(frames >= low) & (frames < high)] - low
            if len(mine):
                mask = np.zeros(int(high - low), dtype=bool)
                mask[mine] = True
                first = int(self._first_sighting[k])
                found.append((int(low), first, self._named(k, first), mask))
        return found

    def _named(self, index: int, first: int) -> Piece:
        piece = self._piece(index)
        if self.labels is None or self.shrinks is None:
            return piece
        span = slice(first, first + len(piece.things))
        return replace(piece, things=self.labels[span], rays=piece.rays * self.shrinks[span, None])

    def _piece(self, index: int) -> Piece:
        if self._held is None or self._held[0] != index:
            self._held = (index, load_piece(self.paths[index]))
        return self._held[1]


def instants_of(views: Sequence[CameraViews]) -> Array:
    """Base times at which the platform is sought: those of the camera with most frames, (n_k,).

    Gaps in that camera's frames are filled at its usual step, and the grid goes on to both sides
    as far as two cameras saw the platform (one, when there is but one).
    """
    times = [np.sort(v.middle_times()[v.status == USED]) for v in views]
    reference = max(times, key=len)
    if len(reference) < 2:
        return reference
    step = float(np.median(np.diff(reference)))
    starts, ends = zip(*((float(t[0]), float(t[-1])) for t in times if len(t)), strict=True)
    first = sorted(starts)[min(1, len(starts) - 1)]  # two cameras, where there are two
    last = sorted(ends)[-min(2, len(ends))]
    grid: list[Array] = []
    before = int(max(np.floor((reference[0] - first) / step + 1e-3), 0))
    grid.append(reference[0] - step * np.arange(before, 0, -1))
    for a, b in pairwise(reference):
        count = max(int(np.floor((b - a) / step + 0.5)), 1)
        if b - a > 0.3 * step:
            grid.append(a + (b - a) * np.arange(count) / count)
    after = int(max(np.floor((last - reference[-1]) / step + 1e-3), 0))
    grid.append(reference[-1] + step * np.arange(after + 1))
    return np.concatenate(grid)


def blocks(
    views: Sequence[CameraViews], watch: Watch, instants_s: Array, poses: Poses | None = None
) -> Iterator[Block]:
    """All sightings of the platform, each at the instant nearest to its frame.

    With `poses` at these instants, the corners are freed of what rolling shutters did to them.
    """
    nearest = [_nearest(v, instants_s) for v in views]
    for first in range(0, len(instants_s), INSTANTS_A_BLOCK):
        last = min(first + INSTANTS_A_BLOCK, len(instants_s))
        block = _block(views, nearest, watch, first, last)
        if poses is not None and any(v.camera.line_time_s != 0.0 for v in views):
            block = replace(block, rays=block.rays - rolling_bias(block, views, poses))
        yield block


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
