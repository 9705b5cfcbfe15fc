"""Gauss-Newton for platform poses from whitened corner rays: the inner loops of tracking.

An observation is one tag (four corners) or marker (one point) in one image, seen at another time
than the instant whose pose (R, p) is sought. The platform has shifted by (s, c) since; a point seen
`lags` later than the others of its tag has moved on:

    x_base = p + s + v dt + a dt^2 / 2 + exp(w dt + al dt^2 / 2) exp(c) R x_platform

Residuals are weighted by W with W'W the inverse covariance of the rays. Increments are dp and a
small rotation dr in the base frame, R <- exp(dr) R.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel
from freeswing.cdpr.elimination import eliminate
from freeswing.vision.fuse.small_rotation import small_rotation

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

# As np.int64 where they are arguments: a literal would be compiled for once more.
MOST_PASSES = 12
ROBUST_LIMIT = 9.0  # mean square of a sighting: beyond three deviations it weighs less


class Seen(NamedTuple):
    """Sightings of some instants, those of instant k at starts[k] ... starts[k + 1].

    Attributes:
        starts: (n_k + 1,).
        cameras: T_camera_base, (n_c, 4, 4).
        camera_of: (n_o,).
        points: platform coordinates, (n_o, 4, 3).
        rays: measured x/z, y/z, (n_o, 8).
        lags: time of each point after the sighting's own, (n_o, 4).
        counts: points in use, (n_o,).
        shifts: of the platform since the instant, position and rotation, (n_o, 6).
        motions: v, w, a, al in the base frame at the sighting's time, (n_o, 12).
    """

    starts: Ints
    cameras: Array
    camera_of: Ints
    points: Array
    rays: Array
    lags: Array
    counts: Ints
    shifts: Array
    motions: Array


class BelievedPoses(NamedTuple):
    """Poses of instants as they are believed to be.

    Attributes:
        rotations: R_base_platform, (n_k, 3, 3).
        positions: (n_k, 3).
        known: where there is one, (n_k,).
    """

    rotations: Array
    positions: Array
    known: Mask


class BelievedPose(NamedTuple):
    """One of them: (3, 3) and (3,)."""

    rotation: Array
    position: Array


class Linear(NamedTuple):
    """Sightings about their poses, rows of markers filled as far as they go.

    Attributes:
        residuals: measured minus predicted rays, (n_o, 8).
        jacobians: of the prediction by position and small rotation, (n_o, 8, 6).
        rates: of the prediction by time, (n_o, 8).
        places: points in the camera's frame, (n_o, 4, 3).
    """

    residuals: Array
    jacobians: Array
    rates: Array
    places: Array


class Solved(NamedTuple):
    """A block's poses.

    Attributes:
        rotations: (n_k, 3, 3).
        positions: (n_k, 3).
        known: where a pose was found, (n_k,).
        covariances: of position and small rotation, NaN where there is no pose, (n_k, 6, 6).
        scores: mean squared whitened residual of each sighting at the solution, -1 where it is
            behind the camera, (n_o,).
    """

    rotations: Array
    positions: Array
    known: Mask
    covariances: Array
    scores: Array

    def poses(self) -> BelievedPoses:
        """The poses that were found."""
        return BelievedPoses(self.rotations, self.positions, self.known)


class SolvedPose(NamedTuple):
    """One instant's pose.

    Attributes:
        rotation: (3, 3).
        position: (3,).
        covariance: of position and small rotation, zero where not free, (6, 6).
        scores: as in `Solved`, of the instant's sightings.
        condition: smallest eigenvalue of the balanced normal matrix; 0 where it has no solution.
    """

    rotation: Array
    position: Array
    covariance: Array
    scores: Array
    condition: float


class _Spare(NamedTuple):
    """Scratch for one sighting: it about its pose, W residual (8,) and W jacobian (8, 6)."""

    found: Linear
    r: Array
    j: Array


@kernel(forceinline=True)
def _times(m: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """The first three rows and columns of a matrix times a vector."""
    return (
        m[0, 0] * x + m[0, 1] * y + m[0, 2] * z,
        m[1, 0] * x + m[1, 1] * y + m[1, 2] * z,
        m[2, 0] * x + m[2, 1] * y + m[2, 2] * z,
    )


@kernel(forceinline=True)
def _product(one: Array, other: Array) -> Array:
    """Of two (3, 3): BLAS takes longer to be called."""
    product = np.empty((3, 3))
    for k in range(3):
        x, y, z = _times(one, other[0, k], other[1, k], other[2, k])
        product[0, k], product[1, k], product[2, k] = x, y, z
    return product


@kernel
def _observe(seen: Seen, o: int, pose: BelievedPose, into: Linear, at: int | np.int64) -> bool:
    """Row `at` of `into` from sighting o at a pose; False when a point is behind the camera."""
    residual, jacobian = into.residuals[at], into.jacobians[at]
    rates, places = into.rates[at], into.places[at]
    shift, motion = seen.shifts[o], seen.motions[o]
    points, rays, lags = seen.points[o], seen.rays[o], seen.lags[o]
    camera = seen.cameras[seen.camera_of[o]]
    turn, step = np.empty((3, 3)), np.empty(3)
    small_rotation(shift[3:], turn)
    rotation = _product(turn, pose.rotation)
    for k in range(seen.counts[o]):
        dt = lags[k]
        half = 0.5 * dt * dt
        a0, a1, a2 = _times(rotation, points[k, 0], points[k, 1], points[k, 2])
        if dt != 0.0:
            for i in range(3):
                step[i] = motion[3 + i] * dt + motion[9 + i] * half
            small_rotation(step, turn)
            a0, a1, a2 = _times(turn, a0, a1, a2)
        spin0, spin1, spin2 = (
            motion[3] + motion[9] * dt,
            motion[4] + motion[10] * dt,
            motion[5] + motion[11] * dt,
        )
        v0 = motion[0] + motion[6] * dt + spin1 * a2 - spin2 * a1
        v1 = motion[1] + motion[7] * dt + spin2 * a0 - spin0 * a2
        v2 = motion[2] + motion[8] * dt + spin0 * a1 - spin1 * a0
        b0 = pose.position[0] + shift[0] + motion[0] * dt + motion[6] * half + a0
        b1 = pose.position[1] + shift[1] + motion[1] * dt + motion[7] * half + a1
        b2 = pose.position[2] + shift[2] + motion[2] * dt + motion[8] * half + a2
        c0, c1, c2 = _times(camera, b0, b1, b2)
        z = c2 + camera[2, 3]
        places[k, 0], places[k, 1], places[k, 2] = c0 + camera[0, 3], c1 + camera[1, 3], z
        if not z > 1e-3:
            return False
        for row in range(2):
            value = places[k, row] / z
            residual[2 * k + row] = rays[2 * k + row] - value
            g0 = (camera[row, 0] - value * camera[2, 0]) / z
            g1 = (camera[row, 1] - value * camera[2, 1]) / z
            g2 = (camera[row, 2] - value * camera[2, 2]) / z
            line = jacobian[2 * k + row]
            line[0], line[1], line[2] = g0, g1, g2
            # d base / d dr = -skew(arm): g' (dr x arm) = dr . (arm x g)
            line[3] = a1 * g2 - a2 * g1
            line[4] = a2 * g0 - a0 * g2
            line[5] = a0 * g1 - a1 * g0
            rates[2 * k + row] = g0 * v0 + g1 * v1 + g2 * v2
    return True


@kernel(forceinline=True)
def _whiten(white: Array, found: Linear, m: int, free: int, r: Array, j: Array) -> None:
    """W residual into r and W jacobian into j over the first m rows; W is lower triangular."""
    residual, jacobian = found.residuals[0], found.jacobians[0]
    for i in range(m):
        r[i] = 0.0
        j[i] = 0.0
        for k in range(i + 1):
            r[i] += white[i, k] * residual[k]
            for c in range(free):
                j[i, c] += white[i, k] * jacobian[k, c]


@kernel
def _unlinearised(count: int | np.int64) -> Linear:
    """Zeros, and points one metre away."""
    return Linear(
        np.zeros((count, 8)), np.zeros((count, 8, 6)), np.zeros((count, 8)), np.ones((count, 4, 3))
    )


@kernel(forceinline=True)
def _equations(
    seen: Seen, whitening: Array, k: int, pose: BelievedPose, bound: float, free: int, spare: _Spare
) -> tuple[Array, Array, Array]:
    """Normal matrix (free, free), right side (free,) and scores of an instant's sightings.

    A sighting whose score exceeds `bound` is weighed down by the square of the excess.
    """
    first, last = seen.starts[k], seen.starts[k + 1]
    normal, right = np.zeros((free, free)), np.zeros(free)
    scores = np.full(last - first, -1.0)
    found, r, j = spare
    for o in range(first, last):
        if not _observe(seen, o, pose, found, np.int64(0)):
            continue
        m = 2 * seen.counts[o]
        _whiten(whitening[o], found, m, free, r, j)
        score = 0.0
        for i in range(m):
            score += r[i] * r[i] / m
        scores[o - first] = score
        weight = 1.0 if score <= bound else (bound / score) ** 2
        for i in range(m):
            for a in range(free):
                right[a] += weight * j[i, a] * r[i]
                for b in range(free):
                    normal[a, b] += weight * j[i, a] * j[i, b]
    return normal, right, scores


@kernel(forceinline=True)
def _balanced(normal: Array) -> Array:
    """A normal matrix whose diagonal is made one."""
    balanced = normal.copy()
    for i in range(len(normal)):
        for j in range(len(normal)):
            scale = math.sqrt(normal[i, i]) + 1e-150
            balanced[i, j] /= scale * (math.sqrt(normal[j, j]) + 1e-150)
    return balanced


@kernel
def solve_instant(
    seen: Seen,
    whitening: Array,
    k: int,
    start: BelievedPose,
    free: int,
    limit: float,
    passes: int | np.int64,
) -> SolvedPose:
    """Robust pose of instant k; `free` is 6, or 3 for the position alone.

    A sighting whose mean squared whitened residual exceeds `limit` is weighed down, only beyond a
    hundred times that in the first pass. `whitening` (n_o, 8, 8) has a W for each sighting.
    """
    rotation, position = start.rotation.copy(), start.position.copy()
    turn, step = np.empty((3, 3)), np.zeros(6)
    covariance = np.zeros((6, 6))
    normal, scores, condition = np.zeros((free, free)), np.zeros(0), 0.0
    spare = _Spare(_unlinearised(np.int64(1)), np.empty(8), np.empty((8, 6)))
    for iteration in range(passes):
        bound = limit * 100.0 if iteration == 0 else limit
        pose = BelievedPose(rotation, position)
        normal, right, scores = _equations(seen, whitening, k, pose, bound, free, spare)
        condition = float(np.linalg.eigvalsh(_balanced(normal))[0])
        if not condition > 1e-9:
            return SolvedPose(rotation, position, covariance, scores, 0.0)
        largest = 0.0
        for i in range(free):
            step[i] = right[i]
        eliminate(normal.copy(), step[:free].reshape(-1, 1))
        for i in range(free):
            largest = max(largest, abs(step[i]))
        for i in range(3):
            position[i] += step[i]
        if free == 6:
            rotation = small_rotation(step[3:], turn) @ rotation
        if largest < 1e-8 and iteration > 1:
            break
    inverse = eliminate(normal, np.eye(free))
    for i in range(free):
        for j in range(free):
            covariance[i, j] = inverse[i, j]
    return SolvedPose(rotation, position, covariance, scores, condition)


@kernel
def solve_block(
    seen: Seen, whitening: Array, start: BelievedPoses, free: int, limit: float
) -> Solved:
    """`solve_instant` for each instant of a block that has a start and points enough."""
    n = len(seen.starts) - 1
    found = Solved(
        start.rotations.copy(),
        start.positions.copy(),
        np.zeros(n, np.bool_),
        np.full((n, 6, 6), np.nan),
        np.full(len(seen.counts), -1.0),
    )
    for k in range(n):
        first, last = seen.starts[k], seen.starts[k + 1]
        points = 0
        for o in range(first, last):
            points += seen.counts[o]
        if not start.known[k] or points < (3 if free == 6 else 2):
            continue
        pose = BelievedPose(start.rotations[k], start.positions[k])
        one = solve_instant(seen, whitening, k, pose, free, limit, np.int64(MOST_PASSES))
        # Not by slices, which bring the text of an error about shapes into what is compiled.
        for o in range(first, last):
            found.scores[o] = one.scores[o - first]
        if one.condition > 0.0:
            found.known[k] = True
            for i in range(3):
                found.positions[k, i] = one.position[i]
                for j in range(3):
                    found.rotations[k, i, j] = one.rotation[i, j]
            for i in range(6):
                for j in range(6):
                    found.covariances[k, i, j] = one.covariance[i, j]
    return found


@kernel
def linearise_block(seen: Seen, poses: BelievedPoses) -> Linear:
    """Every sighting of a block about its pose; zeros where there is none."""
    found = _unlinearised(len(seen.counts))
    for k in range(len(seen.starts) - 1):
        if not poses.known[k]:
            continue
        pose = BelievedPose(poses.rotations[k], poses.positions[k])
        for o in range(seen.starts[k], seen.starts[k + 1]):
            if not _observe(seen, o, pose, found, o):
                found.residuals[o] = 0.0
                found.jacobians[o] = 0.0
                found.rates[o] = 0.0
    return found
