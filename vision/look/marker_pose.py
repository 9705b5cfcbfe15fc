"""Poses from bright spots and the rays to them: a first one from a single view, and better ones.

One camera that sees four markers or more settles both their names and the pose: each choice of
three names has up to four poses (P3P), and the other spots tell which of them is right. A layout
whose markers could be confused is not guessed at.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, permutations

import cv2
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.rotation import exp_rotation, skew
from freeswing.vision.look.single_pose import Pose

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAST_MARKERS = 4  # three have up to four poses
MOST_SPOTS = 8  # what has to be tried grows with their cube
_NEAR_M = 0.004  # a spot may be this far from its marker, by a pose from three others
_EXACT_M = 0.0015  # and this far by the pose from all
_CLEAR = 4.0  # another naming has to fit so many times worse
_STEPS = 8


def pose_from_one_view(layout: Array, spots: Array) -> Pose | None:
    """R_camera_platform and position from unnamed spots of one image; None where unsure.

    Args:
        layout: markers, platform frame, (n, 3).
        spots: undistorted x/z, y/z, (m, 2); of more than `MOST_SPOTS` none is tried.
    """
    if len(layout) < LEAST_MARKERS or not LEAST_MARKERS <= len(spots) <= MOST_SPOTS:
        return None
    rays = np.column_stack([spots, np.ones(len(spots))])
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    best: dict[tuple[int, ...], tuple[int, float, Pose]] = {}
    for pose in _candidates(layout, spots):
        names = _named(layout, pose, rays, _NEAR_M)
        key = tuple(int(name) for name in names)
        hits = int((names >= 0).sum())
        if hits < LEAST_MARKERS or key in best:
            continue
        mine = names >= 0
        better = refined(pose, layout[names[mine]], np.zeros((hits, 3)), rays[mine])
        off = _misses(layout[names[mine]], better, rays[mine])
        if off.max() < _EXACT_M:
            best[key] = (hits, float(np.sqrt(np.mean(off**2))), better)
    ordered = sorted(best.values(), key=lambda one: (-one[0], one[1]))
    if not ordered:
        return None
    rivals = [one[1] for one in ordered[1:] if one[0] == ordered[0][0]]
    sure = all(rms > _CLEAR * max(ordered[0][1], 1e-5) for rms in rivals)
    return ordered[0][2] if sure else None


def refined(pose: Pose, points: Array, origins: Array, rays: Array) -> Pose:
    """The pose that brings points (n, 3) nearest to their rays, in distance over distance.

    Args:
        pose: a start.
        points: platform frame.
        origins: of the rays, (n, 3); with `rays` in the frame that the pose leads to.
        rays: unit, (n, 3).
    """
    turn, shift = pose
    for _ in range(_STEPS):
        arms = points @ turn.T
        away = arms + shift - origins
        depth = np.maximum(np.einsum("ni,ni->n", away, rays), 1e-6)
        across = (np.eye(3) - rays[:, :, None] * rays[:, None, :]) / depth[:, None, None]
        slopes = np.concatenate([across, -across @ skew(arms)], axis=2).reshape(-1, 6)
        errors = np.einsum("nij,nj->ni", across, away).reshape(-1)
        step = -np.linalg.lstsq(slopes, errors, rcond=1e-9)[0]
        shift, turn = shift + step[:3], np.asarray(exp_rotation(step[3:])) @ turn
        if np.abs(step).max() < 1e-10:
            break
    return np.asarray(turn, dtype=np.float64), np.asarray(shift, dtype=np.float64)


def _candidates(layout: Array, spots: Array) -> Iterator[Pose]:
    """Poses of three markers named as three spots, in front of the camera."""
    for markers in combinations(range(len(layout)), 3):
        chosen = layout[list(markers)]
        if np.linalg.matrix_rank(chosen[1:] - chosen[0], tol=0.01) < 2:
            continue
        for seen in permutations(range(len(spots)), 3):
            image = spots[list(seen)].reshape(-1, 1, 2)
            _, turns, shifts = cv2.solveP3P(chosen, image, np.eye(3), None, flags=cv2.SOLVEPNP_AP3P)
            for turn, shift in zip(turns, shifts, strict=True):
                if float(shift[2, 0]) > 0.0:
                    yield exp_rotation(np.float64(turn).ravel()), np.float64(shift).ravel()


def _named(layout: Array, pose: Pose, rays: Array, near_m: float) -> Ints:
    """Marker of each spot, each at most once, -1 where none is near."""
    placed = layout @ pose[0].T + pose[1]
    along = placed @ rays.T
    far = np.sqrt(np.maximum(np.sum(placed**2, axis=1)[:, None] - along**2, 0.0))
    names = np.full(len(rays), -1)
    for marker in range(len(layout)):
        spot = int(np.argmin(far[marker]))
        if far[marker, spot] < near_m and int(np.argmin(far[:, spot])) == marker:
            names[spot] = marker
    return names


def _misses(points: Array, pose: Pose, rays: Array) -> Array:
    placed = points @ pose[0].T + pose[1]
    return np.linalg.norm(np.cross(placed, rays), axis=1)
