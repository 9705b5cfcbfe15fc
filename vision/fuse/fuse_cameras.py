"""All cameras' sightings of a run to one trajectory: a robust solve an instant, with covariance.

Cameras take their frames at different times, so each corner is compared with the pose carried to
its own time by the motion, which is taken from the poses themselves and improved with them. What
squeezed pictures, lenses and the calibration leave beyond pixel noise is found from the residuals,
camera by camera, and counts as noise (`vision.fuse.corner_noise`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.fuse.blocks import RunBlocks
from freeswing.vision.fuse.corner_noise import Noise, NoiseSums, alike, floor_px, whitened
from freeswing.vision.fuse.linearised_block import block_poses, seen_by
from freeswing.vision.fuse.pose_kernels import (
    ROBUST_LIMIT,
    Linear,
    Solved,
    linearise_block,
    solve_block,
)
from freeswing.vision.fuse.poses import Poses, motions_of, unknown_poses, with_course
from freeswing.vision.fuse.rejected_sightings import agreeing
from freeswing.vision.fuse.run_views import Block, CameraViews
from freeswing.vision.fuse.settling import MOST_TO_SETTLE, SETTLED, Settling
from freeswing.vision.look.watched_target import Watch

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_MOTION_PASSES = 4


@dataclass(frozen=True, slots=True)
class Fit:
    """How the sightings agree with the poses, per camera.

    Attributes:
        floor_px: what is left beyond pixel noise, a corner's usual one, (n_c,).
        reprojection_px: root mean square residual of the accepted sightings, (n_c,).
        consistency_m: rms distance at which a camera's mean ray passes the joint pose, (n_c,).
        used: sightings accepted, (n_c,).
        rejected: {(camera, thing): (count, first frame, worst px)} of outliers.
        total: sum of the accepted squared whitened residuals, and their number.
        noise: of the corners, with which the poses were found.
        contradicting: frames of which every sighting is an outlier, two or more, by camera.
    """

    floor_px: Array
    reprojection_px: Array
    consistency_m: Array
    used: NDArray[np.int64]
    rejected: dict[tuple[int, int], tuple[int, int, float]]
    total: tuple[float, int]
    noise: Noise
    contradicting: tuple[tuple[int, ...], ...] = ()


def fuse(
    views: Sequence[CameraViews],
    watch: Watch,
    instants_s: Array,
    start: Poses | None = None,
    passes: int = _MOTION_PASSES,
    *,
    rough: bool = False,
    plain: bool = False,
) -> tuple[Poses, Fit]:
    """Poses at the instants from all cameras.

    Args:
        views: the cameras as they are believed to be, with their sightings.
        watch: what was looked for.
        instants_s: base times sought, (n,).
        start: poses of an earlier call at the same instants.
        passes: solves; each improves the motion and the noise for the next. The last takes the
            noise in its parts: weighed by them, residuals would hide what turns tags, and turns
            would neither find it nor settle.
        rough: leaves the covariances out (0, 6, 6), more than half of what poses take.
        plain: takes all noise as each corner's own, and the motion between poses as known: what is
            wrong with a rig can pass for neither. Poses and motion are not settled.
    """
    run = RunBlocks(views, watch, instants_s, pixels_alone=plain)
    noise = Noise.unknown(len(views))
    poses = unknown_poses(instants_s) if start is None else start
    settling, spare, left = Settling(), 0 if plain else MOST_TO_SETTLE, passes
    while True:
        parts = NoiseSums(noise) if not plain and left == 2 else None
        found, usual, account = _solved(run, poses, noise, parts, kept=left == 1 and not rough)
        if left == 1:
            found = with_course(found, usual, poses.course)
            return replace(found, motions=motions_of(found)), account.fit()
        aim, moved = settling.aim(poses, found, usual)
        poses = with_course(aim, usual, poses.course)
        noise = Noise.plain(account.floors())
        if left == 2 and moved > SETTLED and spare:
            spare -= 1
            continue
        left -= 1
        if parts is not None:
            noise = replace(noise, turned_px=alike(parts.turned_px()))


def _solved(
    run: RunBlocks,
    poses: Poses,
    noise: Noise,
    parts: NoiseSums | None,
    *,
    kept: bool,
) -> tuple[Poses, Array, _Account]:
    """Poses with the motion and the noise as they are, their usual deviations (6,), and sums.

    Usual deviations are zero where none is known, covariances there only if they are `kept`.
    """
    n, views, free = len(poses.times_s), run.views, free_of(run.watch)
    positions, rotations = poses.positions_m.copy(), poses.rotations.copy()
    known = np.zeros(n, dtype=bool)
    covariances = np.full((n if kept else 0, 6, 6), np.nan)
    variances = [np.zeros((0, 6))]
    account = _Account(noise)
    for block in run.at(poses):
        span = slice(block.first, block.first + len(block.starts) - 1)
        begun = block_poses(*_starts(block, positions[span], rotations[span]))
        seen, white = seen_by(block, views), whitened(block, noise, views)
        found = solve_block(seen, white, begun, free, ROBUST_LIMIT)
        linear = linearise_block(seen, found.poses())
        good = account.add(block, views, found, linear)
        if parts is not None:
            parts.add(block, views, good, linear, found.covariances)
        if kept:
            covariances[span] = found.covariances
        can = found.known
        variances.append(np.diagonal(found.covariances[can], axis1=1, axis2=2))
        positions[span] = np.where(can[:, None], found.positions, np.nan)
        rotations[span] = np.where(can[:, None, None], found.rotations, np.nan)
        known[span] = can
    whole = np.concatenate(variances)
    usual = np.sqrt(np.median(whole, axis=0)) if len(whole) else np.zeros(6)
    motions = np.zeros((n, 12))
    return Poses(poses.times_s, positions, rotations, covariances, known, motions), usual, account


def free_of(watch: Watch) -> int:
    """6 where the target gives a pose, 3 where it is a reference point alone."""
    return 6 if watch.platform_points >= 3 else 3


def _starts(block: Block, positions: Array, rotations: Array) -> tuple[Array, Array, Mask]:
    """Where each solve starts: the pose of the pass before, else a single camera's, else a
    neighbour's.
    """  # noqa: D205
    position, rotation = positions.copy(), rotations.copy()
    known = np.isfinite(position[:, 0])
    guessed = ~known & np.isfinite(block.guesses[:, 0, 0])
    position[guessed] = block.guesses[guessed, :3, 3]
    rotation[guessed] = block.guesses[guessed, :3, :3]
    can = known | guessed
    if can.any():
        have = np.flatnonzero(can)
        for k in np.flatnonzero(~can):
            if block.starts[k + 1] > block.starts[k]:
                near = have[np.argmin(np.abs(have - k))]
                position[k], rotation[k], can[k] = position[near], rotation[near], True
    return rotation, position, can


class _Account:
    """Sums over the sightings of a pass."""

    def __init__(self, noise: Noise) -> None:
        cameras = len(noise.floor_px)
        self.used_noise = noise
        self.squares, self.noise = np.zeros(cameras), np.zeros(cameras)
        self.numbers, self.used = np.zeros(cameras), np.zeros(cameras, dtype=np.int64)
        self.misses, self.frames = np.zeros(cameras), np.zeros(cameras)
        self.rejected: dict[tuple[int, int], tuple[int, int, float]] = {}
        self.total, self.count = 0.0, 0
        self.samples: list[list[Array]] = [[] for _ in range(cameras)]
        self.contradicting: list[set[int]] = [set() for _ in range(cameras)]

    def add(
        self,
        block: Block,
        views: Sequence[CameraViews],
        solved: Solved,
        linear: Linear,
    ) -> Mask:
        """Takes a block in; which sightings agree with the poses, (n_o,)."""
        scores, residuals = solved.scores, linear.residuals
        known = np.repeat(solved.known, np.diff(block.starts))
        good = known & agreeing(scores)
        bad = known & ~good
        focal = np.array([v.camera.focal_px.mean() for v in views])[block.camera_of]
        pixels = residuals * focal[:, None]
        own = np.diagonal(block.covariances, axis1=1, axis2=2) * (focal**2)[:, None]
        two = 2 * block.counts
        squares = (pixels**2).sum(axis=1)
        noise = np.where(np.arange(8) < two[:, None], own, 0.0).sum(axis=1)
        np.add.at(self.squares, block.camera_of[good], squares[good])
        np.add.at(self.noise, block.camera_of[good], noise[good])
        np.add.at(self.numbers, block.camera_of[good], two[good])
        np.add.at(self.used, block.camera_of[good], 1)
        self.total += float((scores[good] * two[good]).sum())
        self.count += int(two[good].sum())
        self._add_misses(block, good, residuals, linear.places)
        for camera in range(len(views)):
            mine = known & (scores >= 0.0) & (block.camera_of == camera)
            excess = (squares[mine] - noise[mine]) / two[mine]
            self.samples[camera].append(excess[:: max(1, len(excess) // 500)])
            self.contradicting[camera] |= _whole_frames(block.frames[mine], good[mine])
        for o in np.flatnonzero(bad):
            key = (int(block.camera_of[o]), int(block.things[o]))
            count, first, worst = self.rejected.get(key, (0, int(block.frames[o]), 0.0))
            size = float(np.sqrt(squares[o] / block.counts[o]))
            self.rejected[key] = (count + 1, min(first, int(block.frames[o])), max(worst, size))
        return good

    def _add_misses(self, block: Block, good: Mask, residuals: Array, places: Array) -> None:
        """How far each frame's mean ray passes the joint pose, in metres at its distance."""
        if not good.any():
            return
        instant = np.repeat(np.arange(len(block.starts) - 1), np.diff(block.starts))
        group = instant[good] * len(self.used) + block.camera_of[good]
        names, inverse = np.unique(group, return_inverse=True)
        points = np.bincount(inverse, weights=block.counts[good])
        miss2 = np.zeros(len(names))
        for axis in range(2):
            metres = (residuals[good][:, axis::2] * places[good][:, :, 2]).sum(axis=1)
            miss2 += (np.bincount(inverse, weights=metres) / points) ** 2
        np.add.at(self.misses, names % len(self.used), miss2)
        np.add.at(self.frames, names % len(self.used), 1)

    def floors(self) -> Array:
        """Noise beyond the pixels', by camera: the median excess, safe against outliers."""
        return np.array([floor_px(np.concatenate([np.zeros(0), *parts])) for parts in self.samples])

    def fit(self) -> Fit:
        return Fit(
            self.floors(),
            np.sqrt(self.squares / np.maximum(self.numbers, 1)),
            np.sqrt(self.misses / np.maximum(self.frames, 1)),
            self.used,
            dict(sorted(self.rejected.items())),
            (self.total, self.count),
            self.used_noise,
            tuple(tuple(sorted(frames)) for frames in self.contradicting),
        )


def _whole_frames(frames: NDArray[np.int64], good: Mask) -> set[int]:
    """Frames of a camera's sightings (n,) of which two or more are there and none is good."""
    names, inverse, counts = np.unique(frames, return_inverse=True, return_counts=True)
    agree = np.bincount(inverse, weights=good, minlength=len(names))
    return set(names[(counts > 1) & (agree == 0)].tolist())
