"""A run's sightings by camera, read as they are needed, and blocks of them by instants."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.vision.look.follow import UNSTAMPED, USED
from freeswing.vision.look.pieces import Piece, load_piece

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


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
        shifts: of the platform from its instant to the sighting, (n_o, 6).
        motions: velocity, angular velocity and their rates at the sighting, (n_o, 12).
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
    shifts: Array
    motions: Array

    def sighted_s(self) -> Array:
        """Base time of each sighting: the mean of its points', (n_o,)."""
        there = np.arange(4) < self.counts[:, None]
        return np.where(there, self.times_s, 0.0).sum(axis=1) / self.counts


@dataclass(slots=True)
class CameraViews:
    """One camera's pieces, read as they are needed.

    Attributes:
        camera: its lens, pose and clock as they stand.
        paths: the pieces.
        numbers: frame numbers over all pieces, (n_f,).
        stamps_s: as they are believed, NaN for frames that are left out, (n_f,).
        status: (n_f,).
        labels: things that replace those of the pieces, once markers have names, (n_o,) or None.
        shrinks: factors on the rays of labelled balls, (n_o,) or None.
        growth_px: by how much tags look larger to each side.
    """

    camera: Camera
    paths: Sequence[Path]
    numbers: Ints = field(init=False)
    stamps_s: Array = field(init=False)
    status: Ints = field(init=False)
    labels: Ints | None = field(init=False, default=None)
    shrinks: Array | None = field(init=False, default=None)
    growth_px: float = field(init=False, default=0.0)
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
        copy.labels, copy.shrinks, copy.growth_px = self.labels, self.shrinks, self.growth_px
        return copy

    def grown(self, growth_px: float) -> CameraViews:
        """The same sightings by a camera in which tags look larger to each side."""
        copy = self.believed(self.camera)
        copy.growth_px = growth_px
        return copy

    def restamped(self, stamps_s: Array) -> CameraViews:
        """The same sightings by a camera whose frames were taken at other times, (n_f,).

        Those without a time are left out.
        """
        copy = self.believed(self.camera)
        copy.stamps_s = stamps_s
        copy.status = np.where(np.isfinite(stamps_s), self.status, UNSTAMPED)
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
            own = slice(self._bounds[index], self._bounds[index + 1])
            piece = replace(load_piece(self.paths[index]), stamps_s=self.stamps_s[own])
            self._held = (index, piece)
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
