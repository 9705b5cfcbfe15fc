"""Gives unlabelled bright spots their markers' names, by geometry alone.

Where tags give a pose, a spot is the marker that projects next to it. Without tags, the first
pose comes from spots triangulated over pairs of cameras whose distances match the target's, or
from four or more spots of a single camera; from
then on the motion predicts where each marker must be, through occlusions and crossings: a spot
that two markers could be is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.measured.rigid_fit import fit_rigid
from freeswing.cdpr.rotation import invert
from freeswing.vision.fuse.blocks import blocks
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import Block, CameraViews
from freeswing.vision.look.marker_blobs import ball_shrink
from freeswing.vision.look.marker_pose import pose_from_one_view, refined
from freeswing.vision.look.single_pose import Pose, extrapolate
from freeswing.vision.look.watched_target import Watch

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_GATE_M = 0.03  # a marker may be this far from its prediction
_CLEAR = 0.5  # the second nearest must be at least 1 / _CLEAR times as far
_MATCH_M = 0.008  # a measured target and triangulated markers together
_RAYS_MEET_M = 0.006  # rays of one marker pass each other by less than its radius
_MOST_SPOTS = 14
_FORGET = 10  # frames: after longer a prediction leads nowhere
_START_EVERY = 10  # frames: the search from nothing is slow


@dataclass(slots=True)
class _Tracker:
    """The platform's last poses, which say where the markers are next."""

    watch: Watch
    past: list[tuple[float, Pose]] = field(default_factory=list)
    misses: int = 0
    starts: int = 0

    def may_start(self) -> bool:
        """Whether the costly search from nothing is due: at first, then now and then."""
        self.starts += 1
        return self.starts % _START_EVERY == 1

    def predict(self, time_s: float) -> Pose | None:
        return extrapolate(self.past, time_s)

    def note(self, time_s: float, pose: Pose | None) -> None:
        if pose is None:
            self.misses += 1
            if self.misses > _FORGET:
                self.past.clear()
            return
        self.misses = 0
        self.past = [*self.past, (time_s, pose)][-3:]


def label_markers(
    views: Sequence[CameraViews], watch: Watch, instants_s: Array
) -> tuple[tuple[CameraViews, ...], Poses]:
    """Views whose bright spots carry marker names, and rough poses to start from.

    Args:
        views: cameras with unlabelled spots (thing -1).
        watch: the markers.
        instants_s: base times, (n,).
    """
    labels = [np.full(v.sightings, -1, dtype=np.int64) for v in views]
    shrinks = [np.ones(v.sightings) for v in views]
    n = len(instants_s)
    positions, rotations = np.full((n, 3), np.nan), np.full((n, 3, 3), np.nan)
    tracker = _Tracker(watch)
    centres = np.array([v.camera.position_base_m for v in views])
    for block in blocks(views, watch, instants_s):
        directions = _directions(block, views)
        for k in range(len(block.starts) - 1):
            span = np.arange(block.starts[k], block.starts[k + 1])
            for o in span[block.things[span] >= 0]:
                labels[block.camera_of[o]][block.index[o]] = block.things[o]
            spots = span[block.things[span] < 0]
            if not len(spots):
                continue
            row = block.first + k
            time = float(instants_s[row])
            origins = centres[block.camera_of[spots]]
            rays = directions[spots]
            pose = _pose_here(block, k, tracker, time, origins, rays, block.camera_of[spots])
            if pose is None and tracker.may_start():
                pose = _start_by_one(watch, views, block, spots)
            names = np.full(len(spots), -1)
            if pose is not None:
                names = _nearest(watch, pose, origins, rays, block.camera_of[spots])
                pose = _improved(watch, pose, names, origins, rays)
            tracker.note(time, pose)
            if pose is None:
                continue
            rotations[row], positions[row] = pose
            for o, name in zip(spots, names, strict=True):
                if name >= 0:
                    camera = block.camera_of[o]
                    labels[camera][block.index[o]] = watch.first_marker + name
                    shrinks[camera][block.index[o]] = _shrink(
                        watch, int(name), pose, centres[camera], block.rays[o, :2]
                    )
    named = []
    for view, own, factors in zip(views, labels, shrinks, strict=True):
        copy = view.believed(view.camera)
        copy.labels, copy.shrinks = own, factors
        named.append(copy)
    known = np.isfinite(positions[:, 0])
    return tuple(named), Poses(
        instants_s, positions, rotations, np.zeros((0, 6, 6)), known, np.zeros((n, 12))
    )


def _directions(block: Block, views: Sequence[CameraViews]) -> Array:
    """Unit rays in the base frame, (n_o, 3)."""
    rays = np.concatenate([block.rays[:, :2], np.ones((len(block.rays), 1))], axis=1)
    turns = np.array([v.camera.T_camera_base[:3, :3] for v in views])[block.camera_of]
    out = np.einsum("oji,oj->oi", turns, rays)
    return out / np.linalg.norm(out, axis=1, keepdims=True)


def _pose_here(
    block: Block,
    k: int,
    tracker: _Tracker,
    time_s: float,
    origins: Array,
    rays: Array,
    cameras: Ints,
) -> Pose | None:
    """By tags, by the motion so far, or from nothing."""
    guess = block.guesses[k]
    if np.isfinite(guess[0, 0]):
        return guess[:3, :3], guess[:3, 3]
    predicted = tracker.predict(time_s)
    if predicted is not None:
        return predicted
    return _acquire(tracker.watch, origins, rays, cameras)


def _distances(points: Array, origins: Array, rays: Array) -> Array:
    """Distance of every point from every ray, (n_points, n_rays)."""
    away = points[:, None] - origins
    along = np.einsum("prk,rk->pr", away, rays)
    return np.linalg.norm(away - along[..., None] * rays, axis=2)


def _nearest(watch: Watch, pose: Pose, origins: Array, rays: Array, cameras: Ints) -> Ints:
    """Marker of each spot, -1 where none is near or two could be it."""
    points = watch.marker_positions_m @ pose[0].T + pose[1]
    far = _distances(points, origins, rays)
    names = np.argmin(far, axis=0)
    ordered = np.sort(far, axis=0)
    sure = ordered[0] < _GATE_M
    if len(points) > 1:
        sure &= ordered[0] < _CLEAR * ordered[1]
    for camera in np.unique(cameras):
        mine = cameras == camera
        for name in np.unique(names[mine & sure]):
            rivals = np.flatnonzero(mine & sure & (names == name))
            if len(rivals) > 1:
                order = rivals[np.argsort(far[name, rivals])]
                clear = far[name, order[0]] < _CLEAR * far[name, order[1]]
                sure[order[1:] if clear else order] = False
    return np.where(sure, names, -1)


def _improved(watch: Watch, pose: Pose, names: Ints, origins: Array, rays: Array) -> Pose | None:
    """The pose through the markers that two rays or more fix; None when it is lost."""
    layout, points = [], []
    for name in np.unique(names[names >= 0]):
        mine = names == name
        if mine.sum() >= 2:
            layout.append(watch.marker_positions_m[name])
            points.append(_meeting(origins[mine], rays[mine]))
    if watch.platform_points < 3:
        return (np.eye(3), points[0] - layout[0]) if points else None
    if len(points) >= 3:
        turn, shift = fit_rigid(np.array(layout), np.array(points)[None])
        if np.isfinite(shift).all():
            return turn[0], shift[0]
    named = names >= 0
    if len(np.unique(names[named])) < 3:
        return None
    places = watch.marker_positions_m[names[named]]
    return refined(pose, places, origins[named], rays[named])


def _start_by_one(
    watch: Watch, views: Sequence[CameraViews], block: Block, spots: Ints
) -> Pose | None:
    """A first pose in the base frame by the camera that sees most spots."""
    cameras, counts = np.unique(block.camera_of[spots], return_counts=True)
    camera = int(cameras[np.argmax(counts)])
    mine = spots[block.camera_of[spots] == camera]
    pose = pose_from_one_view(watch.marker_positions_m, block.rays[mine, :2])
    if pose is None:
        return None
    T_base_camera = invert(views[camera].camera.T_camera_base)
    turn = T_base_camera[:3, :3]
    return turn @ pose[0], turn @ pose[1] + T_base_camera[:3, 3]


def _meeting(origins: Array, rays: Array) -> Array:
    """The point nearest to all rays, (3,)."""
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    normal = across.sum(axis=0) + 1e-9 * np.eye(3)
    return np.linalg.solve(normal, np.einsum("nij,nj->i", across, origins))


def _acquire(watch: Watch, origins: Array, rays: Array, cameras: Ints) -> Pose | None:
    """A first pose from spots alone: triangulate over pairs of cameras, match the distances."""
    points: list[Array] = []
    support: list[int] = []
    for a, b in combinations(range(len(rays)), 2):
        if cameras[a] == cameras[b]:
            continue
        point = _meeting(origins[[a, b]], rays[[a, b]])
        far = _distances(point[None], origins, rays)[0]
        ahead = ((point - origins[[a, b]]) * rays[[a, b]]).sum(axis=1)
        if far[[a, b]].max() > _RAYS_MEET_M or (ahead <= 0.0).any():
            continue
        near = [i for i, p in enumerate(points) if np.linalg.norm(p - point) < _RAYS_MEET_M]
        if near:
            continue
        points.append(point)
        support.append(len(np.unique(cameras[far < _RAYS_MEET_M])))
    if not points:
        return None
    order = np.argsort(support, kind="stable")[::-1][:_MOST_SPOTS]
    found = np.array(points)[order]
    layout = watch.marker_positions_m
    if watch.platform_points < 3:
        return np.eye(3), found[0] - layout[0]
    return _match(layout, found)


def _match(layout: Array, found: Array) -> Pose | None:
    """The rigid motion that brings most of the layout onto points found."""
    sides = np.linalg.norm(layout[:, None] - layout, axis=2)
    apart = np.linalg.norm(found[:, None] - found, axis=2)
    best: tuple[int, float, Pose] | None = None
    for markers in combinations(range(len(layout)), 3):
        if np.linalg.matrix_rank(layout[list(markers[1:])] - layout[markers[0]], tol=0.01) < 2:
            continue
        for spots in permutations(range(len(found)), 3):
            i, j = [markers[0], markers[0], markers[1]], [markers[1], markers[2], markers[2]]
            p, q = [spots[0], spots[0], spots[1]], [spots[1], spots[2], spots[2]]
            if np.abs(sides[i, j] - apart[p, q]).max() > _MATCH_M:
                continue
            turn, shift = fit_rigid(layout[list(markers)], found[list(spots)][None])
            if not np.isfinite(shift).all():
                continue
            placed = layout @ turn[0].T + shift[0]
            near = np.linalg.norm(placed[:, None] - found, axis=2).min(axis=1)
            hits = int((near < _MATCH_M).sum())
            cost = float(np.minimum(near, _MATCH_M).sum())
            if best is None or (hits, -cost) > (best[0], -best[1]):
                best = (hits, cost, (turn[0], shift[0]))
    least = min(len(layout), 4)
    return best[2] if best is not None and best[0] >= least else None


def _shrink(watch: Watch, name: int, pose: Pose, centre: Array, ray: Array) -> float:
    diameter = float(watch.marker_diameters_m[name])
    if diameter <= 0.0:
        return 1.0
    distance = float(np.linalg.norm(pose[0] @ watch.marker_positions_m[name] + pose[1] - centre))
    return ball_shrink(ray, np.arcsin(min(0.5 * diameter / distance, 1.0)))
