"""A plane seen by one camera: how points that turn and shift in it fall into the image.

The platform's plane is named by how it leans in the camera (two angles), by how far it is along the
optical axis, and by how much it rises as the platform turns (wires that lean lift it). A lens that
nobody measured adds its focal length and one term of distortion.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.rotation import exp_rotation

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

LENS, PLANE = 2, 4
"""Shared numbers: log focal length over its guess, distortion; lean x, lean y, log distance, rise
in m/rad^2."""
STEP = 1e-6  # of differences: rays and metres are near one
LEAST_DISTANCE = 1e-3


class Items(NamedTuple):
    """What was seen: one tag or one dot in one frame a row.

    Attributes:
        frames: row of its frame, (m,).
        points_m: platform frame, (m, 4, 3); a dot's is there four times.
        rays: as the (guessed) lens has them, (m, 4, 2).
        whitening: W with W'W the inverse covariance of the rays, (m, 8, 8); a dot's rows 2 to 7
            are zero.
    """

    frames: Ints
    points_m: Array
    rays: Array
    whitening: Array

    def of(self, frames: Ints) -> Items:
        """Those of some frames (increasing), which are counted anew."""
        mine = np.isin(self.frames, frames)
        rows = np.searchsorted(frames, self.frames[mine])
        return Items(rows, self.points_m[mine], self.rays[mine], self.whitening[mine])


@dataclass(frozen=True, slots=True)
class Plane:
    """Shared numbers of a run.

    Attributes:
        numbers: in the order of `LENS` and `PLANE`, (6,).
        side: 1 where the camera sees the platform from above, -1 from below.
        turn_rad: about which the platform swings, in the camera's own directions.
    """

    numbers: Array
    side: float
    turn_rad: float

    @property
    def distance_m(self) -> float:
        """Along the optical axis."""
        return float(np.exp(self.numbers[4]))

    @property
    def axes(self) -> Array:
        """Columns: the plane's x, y and up in the camera, (3, 3)."""
        lean = exp_rotation(np.array([self.numbers[2], self.numbers[3], 0.0]))
        return np.asarray(lean @ np.diag([1.0, -self.side, -self.side]))


def placed(items: Items, poses: Array) -> Array:
    """Points in the plane's directions, (m, 4, 3), of poses x, y, chi of the frames, (n, 3).

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, sec. 2.4.1.
    """
    x, y, chi = poses[items.frames].T
    cos, sin = np.cos(chi)[:, None], np.sin(chi)[:, None]
    across, along, up = np.moveaxis(items.points_m, 2, 0)
    moved = [x[:, None] + cos * across - sin * along, y[:, None] + sin * across + cos * along, up]
    return np.stack(moved, axis=2)


def seen(plane: Plane, items: Items, poses: Array) -> Array:
    """Where items fall, in the rays of the guessed lens, (m, 4, 2).

    Source:
        Brown 1966, Decentering distortion of lenses: the radial term; Hartley, Zisserman 2004,
        eq. 6.8.
    """
    points = placed(items, poses)
    turned = poses[items.frames, 2] - plane.turn_rad
    points[:, :, 2] += (plane.numbers[5] * turned**2)[:, None]
    there = points @ plane.axes.T + np.array([0.0, 0.0, plane.distance_m])
    straight = there[:, :, :2] / np.maximum(there[:, :, 2:], LEAST_DISTANCE)
    bend = 1.0 + plane.numbers[1] * (straight**2).sum(axis=2, keepdims=True)
    return np.asarray(np.exp(plane.numbers[0]) * bend * straight)


def off(plane: Plane, items: Items, poses: Array) -> Array:
    """Whitened misses, (m, 8).

    Source:
        Triggs et al. 2000, Bundle adjustment: a modern synthesis, sec. 3.2.
    """
    miss = (seen(plane, items, poses) - items.rays).reshape(-1, 8)
    return np.asarray(np.einsum("mij,mj->mi", items.whitening, miss))


def slopes(plane: Plane, items: Items, poses: Array) -> tuple[Array, Array, Array]:
    """Misses (m, 8), and their slopes by the six shared numbers and the frame's three.

    Source:
        Nocedal, Wright 2006, Numerical Optimization, sec. 8.1: forward differences.
    """
    here = off(plane, items, poses)
    shared = [
        (off(moved(plane, STEP * np.eye(LENS + PLANE)[k]), items, poses) - here) / STEP
        for k in range(LENS + PLANE)
    ]
    own = [(off(plane, items, poses + STEP * np.eye(3)[k]) - here) / STEP for k in range(3)]
    return here, np.stack(shared, axis=2), np.stack(own, axis=2)


def moved(plane: Plane, step: Array) -> Plane:
    """The plane with its shared numbers changed by a step, (6,).

    Source:
        Nocedal, Wright 2006, Numerical Optimization, sec. 10.3.
    """
    return Plane(plane.numbers + step, plane.side, plane.turn_rad)


def start_plane(items: Items, side: float) -> Plane:
    """A plane seen straight from above, as far as the items' sizes say.

    Raises:
        ValueError: where points lie on one another, so that nothing gives a scale.

    Source:
        Hartley, Zisserman 2004, sec. 6.3.1: scaled orthographic projection.
    """
    sizes, apart = [], []
    for frame in np.unique(items.frames)[:50]:
        mine = items.frames == frame
        points = items.points_m[mine][:, :, :2].reshape(-1, 2)
        rays = items.rays[mine].reshape(-1, 2)
        sizes.append(np.sqrt(((points - points.mean(axis=0)) ** 2).sum()))
        apart.append(np.sqrt(((rays - rays.mean(axis=0)) ** 2).sum()))
    size, seen_size = float(np.median(sizes)), float(np.median(apart))
    if not size > 0.0 or not seen_size > 0.0:
        raise ValueError("all points seen lie on one another: nothing gives a scale")
    return Plane(np.array([0.0, 0.0, 0.0, 0.0, np.log(size / seen_size), 0.0]), side, 0.0)


def start_poses(plane: Plane, items: Items, frames: int) -> Array:
    """First poses x, y, chi by the similarity that carries points to rays, (n, 3); NaN: unseen.

    Source:
        Umeyama 1991, Least-squares estimation of transformation parameters, eqs. 40 to 43.
    """
    found = np.full((frames, 3), np.nan)
    order = np.argsort(items.frames, kind="stable")
    rows, starts = np.unique(items.frames[order], return_index=True)
    for row, mine in zip(rows, np.split(order, starts[1:]), strict=True):
        flat = items.points_m[mine][:, :, :2].reshape(-1, 2)
        there = plane.distance_m * items.rays[mine].reshape(-1, 2) * [1.0, -plane.side]
        points, images = (one - one.mean(axis=0) for one in (flat, there))
        cross = points[:, 0] @ images[:, 1] - points[:, 1] @ images[:, 0]
        chi = np.arctan2(cross, (points * images).sum())
        turn = np.array([[np.cos(chi), -np.sin(chi)], [np.sin(chi), np.cos(chi)]])
        found[row] = [*(there.mean(axis=0) - turn @ flat.mean(axis=0)), chi]
    known = np.isfinite(found[:, 2])
    found[known, 2] = np.unwrap(found[known, 2])
    return found
