"""The plane, the lens and every frame's x, y, chi by least squares over a session's runs.

Frames are solved for within the shared numbers (Schur complement): some frames of every run give
the shared ones, which then serve for all frames. What the shared numbers leave uncertain goes into
every sample's covariance, as it moves the sample against its run's rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.planar.plane import (
    LENS,
    PLANE,
    STEP,
    Items,
    Plane,
    moved,
    off,
    slopes,
    start_plane,
    start_poses,
)

Array = NDArray[np.float64]

FRAMES_FOR_PLANE = 60  # of a run: the plane stands still, more say little more
MOST_STEPS = 40
SETTLED = 1e-3  # of a deviation
FRAME_STEPS = 6
FOCAL_STD = 0.35  # of log focal length: from a wide phone to a zoomed one
BEND_STD = 0.1  # of the distortion: phones straighten their films, action cameras do not
LEAN_STD = 0.3  # rad: held above by hand or by a stand, not quite straight
RISE_STD = 0.1  # m/rad^2: radius^2 / (2 length) of wires half a metre apart on a metre
PRINT_STD_M = 1e-4  # of a printed corner: printers stretch a sheet by 0.1 %, and paper curls
DOT_STD_M = 5e-4  # of a dot's middle: by a ruler, and by its light
LEAST_FREEDOM = 0.5  # of the measurements: two dots leave one in four


@dataclass(frozen=True, slots=True)
class RunPlane:
    """One run in its plane.

    Attributes:
        plane: the shared numbers of the run.
        poses: x, y, chi of every frame in the plane's own directions, (n, 3), NaN where unseen.
        covariances: of its pixels' noise, (n, 3, 3).
        systematic: what the shared numbers add, measured from the run's rest, (n, 3, 3).
        noise: misses over what the corners' fit claims, at least 1.
        sightings: that took part.
        miss: rms of the misses in rays.
    """

    plane: Plane
    poses: Array
    covariances: Array
    systematic: Array
    noise: float
    sightings: int
    miss: float


@dataclass(frozen=True, slots=True)
class PlaneFit:
    """All runs of a session by one camera.

    Attributes:
        runs: in their order.
        lens: log focal length over its guess, and the distortion, (2,).
        lens_std: zero where the lens was known.
        lean_std: of each run's lean, rad, (n_runs,).
    """

    runs: tuple[RunPlane, ...]
    lens: Array
    lens_std: Array
    lean_std: Array


@dataclass(frozen=True, slots=True)
class _Run:
    items: Items
    plane: Plane
    poses: Array


def fit_planes(
    runs: Sequence[Items], counts: Sequence[int], side: float, lens_known: bool
) -> PlaneFit:
    """Fit all runs of a camera that stands still within each.

    Args:
        runs: what was seen in each.
        counts: frames of each.
        side: 1: the platform is seen from above, -1 from below.
        lens_known: whether the rays are those of a calibrated lens.

    Raises:
        ValueError: where nothing gives a scale.

    Source:
        Triggs et al. 2000, Bundle adjustment: a modern synthesis, sec. 6.1 (Schur complement).
    """
    chosen = [_begun(_some(items), side) for items in runs]
    free = np.ones(LENS + PLANE * len(runs), dtype=bool)
    free[:LENS] = not lens_known
    prior = np.tile([LEAN_STD, LEAN_STD, np.inf, RISE_STD], len(runs))
    prior = np.concatenate([[FOCAL_STD, BEND_STD], prior])
    damping, cost = 1e-3, _cost(chosen, prior)
    for _ in range(MOST_STEPS):
        normal, right, back = _normal(chosen, prior)
        step = np.zeros(len(free))
        inner = normal[np.ix_(free, free)]
        step[free] = np.linalg.solve(inner + damping * np.diag(np.diag(inner)), right[free])
        trial = [_stepped(run, k, step, back[k]) for k, run in enumerate(chosen)]
        new = _cost(trial, prior)
        if new <= cost:
            size = float(np.max(np.abs(step[free]) * np.sqrt(np.diag(inner))))
            chosen, cost, damping = trial, new, 0.2 * damping
            if size < SETTLED:
                break
        else:
            damping = max(10.0 * damping, 1e-6)
            if damping > 1e8:
                break
    normal = _normal(chosen, prior)[0]
    covariance = np.zeros_like(normal)
    covariance[np.ix_(free, free)] = np.linalg.inv(normal[np.ix_(free, free)])
    growths = [_growth(run) for run in chosen]
    inverse = covariance.copy()
    covariance *= float(np.mean(growths)) ** 2
    covariance += _by_places(chosen, inverse)
    found = []
    for k, items in enumerate(runs):
        places = _places(k)
        shared = covariance[np.ix_(places, places)]
        found.append(_all_frames(items, counts[k], chosen[k].plane, shared))
    std = np.sqrt(np.diag(covariance))
    leans = std[LENS:].reshape(-1, PLANE)[:, :2].max(axis=1)
    return PlaneFit(tuple(found), chosen[0].plane.numbers[:LENS], std[:LENS], leans)


def _some(items: Items) -> Items:
    """Frames spread over the run, those that show most."""
    rows, counts = np.unique(items.frames, return_counts=True)
    full = rows[counts == counts.max()] if (counts == counts.max()).sum() > 20 else rows
    picked = np.unique(np.linspace(0, len(full) - 1, FRAMES_FOR_PLANE).round().astype(np.int64))
    return items.of(full[picked])


def _begun(items: Items, side: float) -> _Run:
    plane = start_plane(items, side)
    poses = start_poses(plane, items, int(items.frames.max()) + 1)
    plane = Plane(plane.numbers, side, float(np.median(poses[:, 2])))
    return _Run(items, plane, poses)


def _by_places(runs: Sequence[_Run], inverse: Array) -> Array:
    """What the shared numbers' covariance owes to where the points really are.

    A corner that was printed, or a dot that was measured, beside its stated place is so in every
    frame: no number of frames averages it.

    Args:
        runs: as fitted.
        inverse: of the normal matrix; zero where a number is held.
    """
    every = np.concatenate([run.items.points_m.reshape(-1, 3) for run in runs])
    points = np.unique(np.round(every, 9), axis=0)
    found = np.zeros_like(inverse)
    for point in points:
        for axis in range(3):
            pull, std = np.zeros(len(inverse)), 0.0
            for k, run in enumerate(runs):
                mine = (np.round(run.items.points_m, 9) == point).all(axis=2)
                if mine.any():
                    dot = mine.all(axis=1).any()
                    std = DOT_STD_M if dot else PRINT_STD_M
                    pull[_places(k)] += _pull(run, mine[:, :, None] * np.eye(3)[axis])
            answer = inverse @ pull
            found += std**2 * np.outer(answer, answer)
    return found


def _pull(run: _Run, shift: Array) -> Array:
    """Gradient on the run's shared numbers of points that lie aside, frames following, (6,).

    Args:
        run: the run.
        shift: of its points, (m, 4, 3).
    """
    items = run.items
    aside = items._replace(points_m=items.points_m + STEP * shift)
    here, shared, own = slopes(run.plane, items, run.poses)
    miss = (off(run.plane, aside, run.poses) - here) / STEP
    inner, mixed, gradient = _by_frame(items, miss, shared, own, len(run.poses))
    solved = np.linalg.solve(inner, gradient[:, :, None])[:, :, 0]
    return np.einsum("mik,mi->k", shared, miss) - np.einsum("nfk,nf->k", mixed, solved)


def _places(run: int) -> NDArray[np.int64]:
    own = LENS + PLANE * run + np.arange(PLANE)
    return np.concatenate([np.arange(LENS), own])


def _cost(runs: Sequence[_Run], prior: Array) -> float:
    found = float(np.sum((_numbers(runs) / prior) ** 2))
    return found + sum(float(np.sum(off(run.plane, run.items, run.poses) ** 2)) for run in runs)


def _numbers(runs: Sequence[_Run]) -> Array:
    return np.concatenate(
        [runs[0].plane.numbers[:LENS], *(run.plane.numbers[LENS:] for run in runs)]
    )


def _normal(runs: Sequence[_Run], prior: Array) -> tuple[Array, Array, list[tuple[Array, Array]]]:
    """Reduced normal matrix and right side of the shared numbers, and what gives the frames."""
    normal, right = np.diag(1.0 / prior**2), -_numbers(runs) / prior**2
    back = []
    for k, run in enumerate(runs):
        miss, shared, own = slopes(run.plane, run.items, run.poses)
        inner, mixed, gradient = _by_frame(run.items, miss, shared, own, len(run.poses))
        places = _places(k)
        solved = np.linalg.solve(inner, np.concatenate([mixed, gradient[:, :, None]], axis=2))
        whole = np.einsum("mik,mil->kl", shared, shared)
        kept = whole - np.einsum("nfk,nfl->kl", mixed, solved[:, :, :-1])
        side = np.einsum("mik,mi->k", shared, miss)
        left = side - np.einsum("nfk,nf->k", mixed, solved[:, :, -1])
        normal[np.ix_(places, places)] += kept
        right[places] -= left
        back.append((solved[:, :, :-1], solved[:, :, -1]))
    if not np.isfinite(normal).all():
        raise ValueError("the plane cannot be fitted: a frame's points give no pose")
    return normal, right, back


def _by_frame(
    items: Items, miss: Array, shared: Array, own: Array, frames: int
) -> tuple[Array, Array, Array]:
    """Normal matrices by frame: its own (n, 3, 3), with the shared (n, 3, 6), and gradients."""
    inner = np.tile(1e-12 * np.eye(3), (frames, 1, 1))
    mixed, gradient = np.zeros((frames, 3, shared.shape[2])), np.zeros((frames, 3))
    np.add.at(inner, items.frames, np.einsum("mik,mil->mkl", own, own))
    np.add.at(mixed, items.frames, np.einsum("mik,mil->mkl", own, shared))
    np.add.at(gradient, items.frames, np.einsum("mik,mi->mk", own, miss))
    return inner, mixed, gradient


def _stepped(run: _Run, place: int, step: Array, back: tuple[Array, Array]) -> _Run:
    mine = step[_places(place)]
    poses = run.poses - back[1] - back[0] @ mine
    plane = moved(run.plane, mine)
    return _Run(run.items, Plane(plane.numbers, plane.side, float(np.median(poses[:, 2]))), poses)


def _growth(run: _Run) -> float:
    """Misses over what the corners' fit claims, at least 1."""
    squares = float(np.sum(off(run.plane, run.items, run.poses) ** 2))
    rows = int(np.sum(np.abs(run.items.whitening).sum(axis=2) > 0.0))
    freedom = max(rows - 3 * len(run.poses) - PLANE, LEAST_FREEDOM)
    return max(1.0, float(np.sqrt(squares / freedom)))


def _all_frames(items: Items, frames: int, plane: Plane, shared: Array) -> RunPlane:
    """Every frame's pose in the run's plane."""
    poses = start_poses(plane, items, frames)
    known = np.isfinite(poses).all(axis=1)
    rows = np.flatnonzero(known)
    mine = items.of(rows)
    own = poses[rows]
    for _ in range(FRAME_STEPS):
        inner, _, gradient = _by_frame(mine, *slopes(plane, mine, own), len(rows))
        own = own - np.linalg.solve(inner, gradient[:, :, None])[:, :, 0]
    inner, mixed, _ = _by_frame(mine, *slopes(plane, mine, own), len(rows))
    run = _Run(mine, plane, own)
    growth = _growth(run)
    covariances = np.full((frames, 3, 3), np.nan)
    covariances[rows] = growth**2 * np.linalg.inv(inner)
    answer = -np.linalg.solve(inner, mixed)
    answer = answer - answer.mean(axis=0)
    systematic = np.full((frames, 3, 3), np.nan)
    systematic[rows] = answer @ shared @ np.swapaxes(answer, 1, 2)
    poses[rows] = own
    miss_rays = off(plane, Items(*mine[:3], _unit(mine.whitening)), own)
    used = np.abs(mine.whitening).sum(axis=2) > 0.0
    rms = float(np.sqrt(np.mean(miss_rays[used] ** 2)))
    return RunPlane(plane, poses, covariances, systematic, growth, len(mine.frames), rms)


def _unit(whitening: Array) -> Array:
    """Whitening that leaves rays as they are, and what was not seen out."""
    found = np.zeros_like(whitening)
    used = np.abs(whitening).sum(axis=2) > 0.0
    found[:, np.arange(8), np.arange(8)] = used
    return found
