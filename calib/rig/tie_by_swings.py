"""Cameras that share no view of the board, tied by the platform that all of them see swing.

The platform's tags are one rigid body, its layout that of target.toml to the tags' deviations:
where each tag really sits is an unknown beside the cameras. Frames of the swings are
views as the board's are: they join the same moments, pieces of smooth motion, clocks and lenses,
and one adjustment weighs everything. In the points of that adjustment the platform's corners come
after the board's, with rows of NaN between (`calib.rig.normal_equations.Problem`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from freeswing.calib.board.motion_pieces import NONE, REST, Timeline
from freeswing.calib.board.platform_as_board import PlatformTags
from freeswing.calib.board.recordings import find_recordings
from freeswing.calib.board.sightings import Sightings, gather, see_platform
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.intrinsics import CameraStart
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.coarse_clocks import coarse_clocks
from freeswing.calib.rig.tie_by_shared_boards import board_groups, pose_from_points
from freeswing.calib.rig.views import Views, joined_views
from freeswing.cdpr.system.progress import Progress

_GAP_S = 100.0  # between recordings on the common timeline
_MOST_MISS_PX = 3.0  # lenses known roughly leave a pixel or two, a tag misread tens
MOST_RUNS = 2
"""Runs looked at: one of some hundred frames ties cameras to tenths of a millimetre."""


@dataclass(frozen=True, slots=True)
class Swing:
    """One run's recordings of the platform.

    Attributes:
        name: of the run.
        sightings: of each camera of the calibration, in order; empty ones where it saw nothing.
    """

    name: str
    sightings: tuple[Sightings, ...]


@dataclass(frozen=True, slots=True)
class SwingFilms:
    """Recordings of the swinging platform, looked at only where the board does not tie cameras.

    Attributes:
        tags: the platform's.
        runs: name and folder of recordings of each run.
        kept: folder that keeps the tags found so far, None for none.
    """

    tags: PlatformTags
    runs: tuple[tuple[str, Path], ...]
    kept: Path | None = None

    def seen(
        self,
        boards: tuple[Sightings, ...],
        frame_rate_hz: float | None,
        progress: Progress | None = None,
    ) -> tuple[Swing, ...]:
        """The platform in every run, for the cameras that saw a board."""
        cameras = [(camera.name, camera.size_px) for camera in boards]
        found = []
        for name, folder in self.runs[:MOST_RUNS]:
            recordings = {one.name: one for one in find_recordings(folder)}
            told = see_platform(recordings, cameras, self.tags, frame_rate_hz, progress, self.kept)
            found.append(Swing(name, told))
        return tuple(found)


@dataclass(frozen=True, slots=True)
class Joined:
    """What is adjusted: board and platform.

    Attributes:
        points_m: the board's corners, rows of NaN, the platform's, (n, 3).
        starts: cameras with the views of both.
        offsets_s: clock offsets to start from, (n_c,).
        line: times and pieces of all moments, None where nothing moves by known times.
        unknown: cameras whose start only their stamps tell, by index.
        layout_std_m: of each tag of the platform, where it takes part, (n_tags,).
    """

    points_m: Array
    starts: tuple[CameraStart, ...]
    offsets_s: Array
    line: Timeline | None
    unknown: tuple[int, ...]
    layout_std_m: Array | None = None


def joined(
    before: Joined, body: PlatformTags, swings: tuple[Swing, ...], frame_rate_hz: float | None
) -> Joined:
    """Board and swings together.

    Args:
        before: the board alone.
        body: the platform's tags.
        swings: with frames that carry stamps; others say nothing of who saw what when.
        frame_rate_hz: nominal rate, None when unknown.
    """
    starts = before.starts
    cameras = tuple(start.camera for start in starts)
    size = starts[0].views.group_size
    gap = np.full((size, 3), np.nan)
    points = np.concatenate([before.points_m, gap, body.points_m])
    first, behind = len(before.points_m) + size, len(body.points_m) + size
    parts = [_widened(start.views, 0, behind) for start in starts]
    poses = [start.T_camera_boards for start in starts]
    line, n_moments = before.line, 1 + max(int(start.views.moment.max()) for start in starts)
    times = np.zeros(n_moments) if line is None else line.times_s
    piece = np.full(n_moments, REST) if line is None else line.piece
    offsets, unknown = before.offsets_s.copy(), set(before.unknown)
    groups = board_groups(len(starts), joined_views(parts))
    for swing in swings:
        stamps = tuple(seen.stamps_s for seen in swing.sightings)
        told = coarse_clocks(_tracks(cameras, swing, body), stamps)
        if swing is swings[0]:
            alone = np.array([np.sum(groups == own) == 1 for own in groups])
            offsets = np.where(alone, told.offsets_s, offsets)
            unknown |= set(told.unknown)
        seen = gather(swing.sightings, frame_rate_hz, offsets)
        if seen.line is None:
            continue
        shift = float(times.max(initial=0.0)) + _GAP_S - float(seen.line.times_s.min(initial=0.0))
        free = int(piece.max(initial=NONE)) + 1
        own = np.where(seen.line.piece >= 0, seen.line.piece + free, NONE)
        for index, camera in enumerate(cameras):
            views = seen.views.select(seen.views.camera == index)
            T, good = _poses(camera, body, views.pixels)
            views = _widened(_grouped(views.select(good), size), first, 0)
            moment = views.moment + len(times)
            parts[index] = joined_views([parts[index], replace(views, moment=moment, piece=moment)])
            poses[index] = np.concatenate([poses[index], T[good]])
        times = np.concatenate([times, seen.line.times_s + shift])
        piece = np.concatenate([piece, own])
    both = tuple(
        replace(start, views=views, T_camera_boards=T)
        for start, views, T in zip(starts, parts, poses, strict=True)
    )
    moves = bool((piece >= 0).any())
    known = Timeline(times, piece) if moves else None
    return Joined(
        points, both, offsets, known, tuple(sorted(unknown)), np.array(body.std_m, dtype=float)
    )


def _tracks(
    cameras: tuple[Camera, ...], swing: Swing, body: PlatformTags
) -> tuple[CameraStart, ...]:
    """The platform in each camera on its own, as far as clocks need it."""
    tracks = []
    for camera, seen in zip(cameras, swing.sightings, strict=True):
        T, good = _poses(camera, body, seen.pixels)
        turns = np.where(good[:, None, None], T, np.eye(4))
        tracks.append(CameraStart(camera, turns, _none(seen), (), 0.0))
    return tuple(tracks)


def _none(seen: Sightings) -> Views:
    """No views, of as many corners."""
    shape = seen.pixels.shape[1:]
    empty = np.zeros(0, dtype=int)
    whitening = np.zeros((0, *seen.covariance_px2.shape[1:]))
    return Views(empty, empty, empty, np.zeros((0, *shape)), np.zeros(0), whitening, ())


def _poses(camera: Camera, body: PlatformTags, pixels: Array) -> tuple[Array, np.ndarray]:
    """T_camera_platform of each frame, and where it fits, (n, 4, 4) and (n,)."""
    points = body.points_m
    poses, good = np.tile(np.eye(4), (len(pixels), 1, 1)), np.zeros(len(pixels), dtype=bool)
    for k, seen in enumerate(pixels):
        known = np.isfinite(seen[:, 0])
        T = pose_from_points(camera, points[known], seen[known]) if known.any() else None
        if T is None:
            continue
        miss = seen[known] - camera.project(points[known] @ T[:3, :3].T + T[:3, 3])
        good[k] = float(np.sqrt(np.mean(miss**2))) < _MOST_MISS_PX
        poses[k] = T
    return poses, good


def _grouped(views: Views, size: int) -> Views:
    """The views with corners in groups of `size`: tags come apart where the board has none."""
    if views.group_size == size:
        return views
    alike = np.tile(np.eye(2 * size), (len(views), views.pixels.shape[1] // size, 1, 1))
    return replace(views, whitening=alike)


def _widened(views: Views, before: int, after: int) -> Views:
    """The views with so many unseen points before and after."""
    pixels = np.pad(views.pixels, ((0, 0), (before, after), (0, 0)), constant_values=np.nan)
    size = views.group_size
    head, tail = (
        np.tile(np.eye(2 * size), (len(views), points // size, 1, 1)) for points in (before, after)
    )
    whitening = np.concatenate([head, views.whitening, tail], axis=1)
    return replace(views, pixels=pixels, whitening=np.ascontiguousarray(whitening))
