"""One run's film from above, and what its camera saw as the plane's fit takes it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.recordings import Recording
from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.look.single_pose import whitening
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.planar.dots import Spots, followed, moving, named, side_of_dots
from freeswing.vision.planar.film_faults import unseen_text
from freeswing.vision.planar.plane import Items

Array = NDArray[np.float64]

CORNER_FLOOR_PX = 0.01  # no corner is found better, whatever a clean image claims


class FilmedRun(Protocol):
    """What a run has to have: a name, its folder of one recording, and the part that counts."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def video(self) -> Path | None: ...  # noqa: D102
    @property
    def window_s(self) -> tuple[float, float] | None: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Film:
    """One run's film and what its camera saw."""

    run: FilmedRun
    recording: Recording
    views: CameraViews

    def known(self, times_s: Array, seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Frames that show the platform, within the run's window where it has one."""
        if self.run.window_s is None:
            return seen
        start, end = self.run.window_s
        return seen & (times_s >= start) & (times_s <= end)


def side_of(watch: Watch, film: Film) -> float:
    """1 where the camera looks down on the platform, -1 where it looks up.

    By which way tags face, or by whether known dots are seen as a mirror has them.

    Raises:
        InputError: for tags that lie askew.
        DataError: for dots that cannot be followed.
    """
    if not watch.tags:
        spots, points = spots_of(film), watch.marker_positions_m[:, :2]
        return side_of_dots(dots_of(film, spots, watch, len(points)), spots, points)
    corners = watch.tag_corners_m
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 0] - corners[:, 3])
    facing = normals[:, 2] / np.linalg.norm(normals, axis=1)
    if (np.abs(facing) < 0.99).any() or np.ptp(np.sign(facing)) > 0.0:
        raise InputError(
            "target.toml: --planar takes tags that lie flat in the platform's plane, all facing "
            "up or all down (z of q_platform_tag along the platform's z)"
        )
    return float(np.sign(facing[0]))


def place_of(watch: Watch) -> Array:
    """The point of the platform whose x and y are given: above or below P as high as the tags."""
    points = watch.tag_corners_m.reshape(-1, 3) if watch.tags else watch.marker_positions_m
    return np.array([0.0, 0.0, float(points[:, 2].mean())])


def tag_items(film: Film, watch: Watch) -> Items:
    """Tags of every frame.

    Source:
        Triggs et al. 2000, Bundle adjustment: a modern synthesis, sec. 3.1: weights.
    """
    focal = float(film.views.camera.focal_px.mean())
    floor = (CORNER_FLOOR_PX / focal) ** 2 * np.eye(8)
    parts = []
    for first, piece in film.views.pieces():
        mine = piece.things >= 0
        parts.append(
            Items(
                first + piece.frame_of[mine],
                watch.tag_corners_m[piece.things[mine]],
                piece.rays[mine].reshape(-1, 4, 2),
                whitening(piece.covariances[mine] + floor),
            )
        )
    return Items(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def spots_of(film: Film) -> Spots:
    """Bright spots of every frame."""
    parts = []
    for first, piece in film.views.pieces():
        mine = piece.things < 0
        covariances = piece.covariances[mine][:, :2, :2]
        parts.append(Spots(first + piece.frame_of[mine], piece.rays[mine][:, :2], covariances))
    return Spots(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def dots_of(film: Film, spots: Spots, watch: Watch, wanted: int) -> NDArray[np.int64]:
    """Index of each dot's spot by frame, (wanted, n)."""
    dots = followed(spots, len(film.views.numbers))
    if len(dots) < wanted:
        if not len(spots.frames):
            raise DataError(unseen_text(watch, film.recording, film.run.name))
        raise DataError(
            f"run {film.run.name}: {film.recording.path.name}: {len(dots)} bright dots can be "
            f"followed through the run, {wanted} are needed: keep them in view, round, and "
            "brighter than all around them"
        )
    return moving(dots, spots, wanted)


def dot_items(film: Film, watch: Watch, side: float) -> Items:
    """Dots of every frame that shows two or more, seen from above (side 1) or below (-1).

    Source:
        Triggs et al. 2000, Bundle adjustment: a modern synthesis, sec. 3.1: weights.
    """
    spots = spots_of(film)
    points = watch.marker_positions_m
    dots = named(dots_of(film, spots, watch, len(points)), spots, points[:, :2], side)
    focal = float(film.views.camera.focal_px.mean())
    floor = (CORNER_FLOOR_PX / focal) ** 2 * np.eye(2)
    frames, places, rays, white = [], [], [], []
    for dot, point in zip(dots, points, strict=True):
        mine = dot[dot >= 0]
        own = np.zeros((len(mine), 8, 8))
        own[:, :2, :2] = whitening(spots.covariances[mine] + floor)
        frames.append(np.flatnonzero(dot >= 0))
        places.append(np.tile(point, (len(mine), 4, 1)))
        rays.append(np.repeat(spots.rays[mine][:, None], 4, axis=1))
        white.append(own)
    items = Items(*(np.concatenate(part) for part in (frames, places, rays, white)))
    rows, counts = np.unique(items.frames, return_counts=True)
    return (
        Items(items.frames, *items[1:]) if (counts >= 2).all() else _pairs(items, rows[counts >= 2])
    )


def _pairs(items: Items, frames: NDArray[np.int64]) -> Items:
    """Those of frames that show two dots at least: one shows no yaw."""
    mine = np.isin(items.frames, frames)
    return Items(items.frames[mine], items.points_m[mine], items.rays[mine], items.whitening[mine])


def times_of(film: Film, items: Items) -> Array:
    """When each frame's platform was seen: rows of a rolling shutter have their own time.

    Source:
        Hedborg et al. 2012, Rolling shutter bundle adjustment, sec. 3.
    """
    times = film.views.middle_times()
    camera = film.views.camera
    if camera.line_time_s == 0.0:
        return times
    counts = np.maximum(np.bincount(items.frames, minlength=len(times)), 1)
    rays = items.rays.mean(axis=1)
    pixels = camera.project(np.column_stack([rays, np.ones(len(rays))]))
    rows = np.bincount(items.frames, pixels[:, 1], len(times)) / counts
    middle = 0.5 * (camera.size_px[1] - 1)
    return times + camera.line_time_s * (rows - middle)
