"""Two cameras' sightings of a swing as their own clocks stamp them, without a picture.

Corners are placed by a pinhole and noise, when each was seen; what is wrong with how a camera stood
and recorded is made here, and told to nobody.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.rotation import exp_rotation
from freeswing.demo.rig import base_tags, demo_target
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.look.follow import STATUS_NAMES, USED
from freeswing.vision.look.pieces import Piece, save_piece
from freeswing.vision.look.watched_target import Watch
from tests.samples import make_filmed as filmed
from tests.vision.scenes import SurveyedTag

Motion = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
Mode = tuple[float, tuple[float, float, float], tuple[float, float, float]]
RATE_HZ = 20.0
NOISE_PX = 0.02
# Hz, m along x, y, z, rad about them
MODES = (
    (0.83, (0.05, 0.02, 0.01), (0.02, 0.05, 0.03)),
    (1.31, (0.01, 0.03, 0.02), (0.05, 0.01, 0.06)),
    (2.57, (0.002, 0.004, 0.004), (0.02, 0.02, 0.01)),
)
ALONE_M, ALONE_RAD = np.array([3e-4, 3e-4, 2e-3]), 2e-3
"""What one camera's own pose errs by."""


@dataclass(frozen=True)
class Recorded:
    """How a camera recorded, beside what its calibration says.

    Attributes:
        late_s: after the other's first frame; its stamps begin at zero.
        rate: seconds that its stamps tell a second.
        dropped: share of its frames that are lost.
        copies: of so many frames one repeats the frame before, which tracking leaves out.
        jitter_s: deviation of its stamps.
        turned_rad: about its own y, x since it was calibrated.
        line_time_s: of a rolling shutter.
    """

    late_s: float = 0.0
    rate: float = 1.0
    dropped: float = 0.0
    copies: int = 0
    jitter_s: float = 0.0
    turned_rad: float = 0.0
    line_time_s: float = 0.0


def damped(modes: Sequence[Mode]) -> Motion:
    """Positions (n, 3) and rotations (n, 3, 3) of some modes, by times (n,)."""

    def motion(times_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        t = np.asarray(times_s)[:, None]
        places, turns = np.zeros((len(t), 3)) + filmed.CENTRE_M, np.zeros((len(t), 3))
        for k, (hz, way, turn) in enumerate(modes):
            phase = 2.0 * np.pi * hz * t + np.array([0.2, 1.4, 2.7]) * (k + 1)
            places = places + np.exp(-0.04 * t) * np.array(way) * np.sin(phase)
            turns = turns + np.exp(-0.04 * t) * np.array(turn) * np.cos(phase)
        return places, exp_rotation(turns)

    return motion


SWING = damped(MODES)


def frame_times(own: Recorded, seconds: float, rng: np.random.Generator):
    """Frame numbers, when they were taken, their stamps, which repeat the one before."""
    count = int((seconds - own.late_s) * RATE_HZ)
    numbers = np.arange(count)
    keep = rng.random(count) >= own.dropped
    keep[:2] = True
    even = numbers / RATE_HZ
    stamps = even * own.rate + own.jitter_s * rng.standard_normal(count)
    copy = (numbers % own.copies == own.copies - 1) if own.copies else np.zeros(count, dtype=bool)
    return numbers[keep], (own.late_s + even)[keep], stamps[keep], copy[keep]


def _rays(camera: Camera, motion: Motion, times_s, points) -> np.ndarray:
    """Of platform points (k, 3) at times (n,) or (n, k): (n, k, 2)."""
    times = np.broadcast_to(
        np.asarray(times_s).reshape(len(times_s), -1), (len(times_s), len(points))
    )
    places, turns = motion(times.ravel())
    at = np.einsum("nij,nj->ni", turns, np.tile(points, (len(times), 1))) + places
    seen = camera.to_camera(at)
    return (seen[:, :2] / seen[:, 2:]).reshape(len(times), len(points), 2)


def _rows(camera: Camera, rays: np.ndarray) -> np.ndarray:
    flat = np.concatenate([rays.reshape(-1, 2), np.ones((rays[..., 0].size, 1))], axis=1)
    return camera.project(flat)[:, 1].reshape(rays.shape[:-1])


def _seen(camera: Camera, motion: Motion, times_s, corners, line_time_s: float):
    """A tag's corners as a pattern fit has them, and their rows: (n, 8), (n, 4)."""
    if not line_time_s:
        rays = _rays(camera, motion, times_s, corners)
        return rays.reshape(-1, 8), _rows(camera, rays)
    a, b = (part.ravel() for part in np.meshgrid(np.linspace(0, 1, 7), np.linspace(0, 1, 7)))
    share = np.stack([(1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b], axis=1)
    points = share @ corners
    middle = 0.5 * (camera.size_px[1] - 1)
    rays = _rays(camera, motion, times_s, points)
    for _ in range(3):
        at = times_s[:, None] + line_time_s * (_rows(camera, rays) - middle)
        rays = _rays(camera, motion, at, points)
    unit = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    found = np.empty((len(times_s), 4, 2))
    zero, one = np.zeros_like(a), np.ones_like(a)
    for n, (u, v) in enumerate(np.moveaxis(rays, -1, 1)):
        rows = np.concatenate(
            [
                np.stack([a, b, one, zero, zero, zero, -u * a, -u * b], axis=1),
                np.stack([zero, zero, zero, a, b, one, -v * a, -v * b], axis=1),
            ]
        )
        h = np.append(np.linalg.lstsq(rows, np.concatenate([u, v]), rcond=None)[0], 1.0)
        flat = np.column_stack([unit, np.ones(4)]) @ h.reshape(3, 3).T
        found[n] = flat[:, :2] / flat[:, 2:]
    return found.reshape(-1, 8), _rows(camera, found)


def made_views(
    folder: Path,
    recorded: Sequence[Recorded],
    *,
    seconds: float = 6.0,
    with_base_tags: bool = True,
    motion: Motion = SWING,
    seed: int = 5,
    size: float = 1.0,
) -> tuple[list[CameraViews], Watch]:
    """What both cameras of samples/filmed saw, as they were calibrated."""
    rng = np.random.default_rng(seed)
    surveyed = [SurveyedTag(tag) for tag in base_tags()]
    watch = Watch.of(demo_target(), surveyed if with_base_tags else ())
    views = []
    for told, own in zip(filmed.cameras(), recorded, strict=True):
        told = replace(told, clock_offset_s=0.0)
        pose = told.T_camera_base.copy()
        pose[:3] = exp_rotation(own.turned_rad * np.array([0.6, 0.8, 0.0])) @ pose[:3]
        camera = replace(told, T_camera_base=pose)
        piece = _piece(camera, own, watch, motion, seconds, rng, size)
        path = folder / f"{camera.name}.npz"
        nothing: Any = SimpleNamespace(past=[], base_rays={}, before={}, misses=0, count=0)
        save_piece(path, piece, nothing)
        views.append(CameraViews(told, (path,)))
    return views, watch


def _piece(camera: Camera, own: Recorded, watch: Watch, motion, seconds, rng, size) -> Piece:
    numbers, taken, stamps, copy = frame_times(own, seconds, rng)
    n, focal = len(numbers), camera.focal_px.mean()
    # a stamp is that of the first row's middle of the picture's rows: line times count from row 0
    middle = own.line_time_s * 0.5 * (camera.size_px[1] - 1)
    columns = [
        _seen(camera, motion, taken + middle, c * size, own.line_time_s)
        for c in watch.tag_corners_m
    ]
    still = (
        camera.to_camera(watch.base_corners_m) if len(watch.base_corners_m) else np.zeros((0, 4, 3))
    )
    for corners in still[..., :2] / still[..., 2:]:
        columns.append(
            (np.tile(corners.reshape(1, 8), (n, 1)), np.tile(_rows(camera, corners), (n, 1)))
        )
    rays = np.stack([one for one, _ in columns], axis=1)
    rows = np.stack([one for _, one in columns], axis=1)
    rays = rays + NOISE_PX / focal * rng.standard_normal(rays.shape)
    places, turns = motion(taken + middle)
    T = camera.T_camera_base
    alone = exp_rotation(ALONE_RAD * rng.standard_normal((n, 3))) @ (T[:3, :3] @ turns)
    at = places @ T[:3, :3].T + T[:3, 3] + ALONE_M * rng.standard_normal((n, 3))
    poses = np.hstack([alone.reshape(-1, 9), at])
    poses[copy] = np.nan
    status = np.where(copy, STATUS_NAMES.index("repeated frame"), USED)
    kinds = len(columns)
    return Piece(
        numbers, stamps, status, poses,
        np.repeat(np.arange(n), kinds), np.tile(np.arange(kinds), n), rays.reshape(-1, 8),
        np.tile((NOISE_PX / focal) ** 2 * np.eye(8), (n * kinds, 1, 1)),
        rows.reshape(-1, 4), np.ones((n * kinds, 2)),
    )  # fmt: skip
