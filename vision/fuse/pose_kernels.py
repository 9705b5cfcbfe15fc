"""Gauss-Newton for platform poses from whitened corner rays: the inner loops of tracking.

An observation is one tag (four corners) or marker (one point) in one image, taken `lags` seconds
from the instant whose pose is sought. With the pose (R, p) at the instant and its motion,

    x_base = p + v dt + a dt^2 / 2 + exp(w dt + al dt^2 / 2) R x_platform

Residuals are weighted by W with W'W the inverse covariance of the rays. Increments are dp and a
small rotation dr in the base frame, R <- exp(dr) R.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@numba.njit(cache=True, nogil=True)
def small_rotation(r: Array, out: Array) -> None:
    """exp(skew(r)) into `out` (3, 3)."""
    angle2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    angle = math.sqrt(angle2)
    if angle < 1e-6:
        a, b = 1.0 - angle2 / 6.0, 0.5 - angle2 / 24.0
    else:
        a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle2
    x, y, z = r[0], r[1], r[2]
    out[0, 0] = 1.0 - b * (y * y + z * z)
    out[1, 1] = 1.0 - b * (x * x + z * z)
    out[2, 2] = 1.0 - b * (x * x + y * y)
    out[0, 1], out[1, 0] = b * x * y - a * z, b * x * y + a * z
    out[0, 2], out[2, 0] = b * x * z + a * y, b * x * z - a * y
    out[1, 2], out[2, 1] = b * y * z - a * x, b * y * z + a * x


@numba.njit(cache=True, nogil=True)
def carried_on(
    times_s: Array, rotations: Array, positions: Array, time_s: float
) -> tuple[Array, Array]:
    """Rotation (3, 3) and position (3,) at a time, by the polynomial through poses (n, ...)."""
    n = len(times_s)
    ahead, turn = np.zeros(6), np.empty((3, 3))
    for k in range(n - 1):
        weight = 1.0
        for j in range(n):
            if j != k:
                weight *= (time_s - times_s[j]) / (times_s[k] - times_s[j])
        turn[:] = rotations[k] @ rotations[n - 1].T
        x, y, z = turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]
        sine = 0.5 * math.sqrt(x * x + y * y + z * z)
        cosine = 0.5 * (turn[0, 0] + turn[1, 1] + turn[2, 2] - 1.0)
        factor = 0.5 if sine < 1e-9 else 0.5 * math.atan2(sine, cosine) / sine
        for a in range(3):
            ahead[a] += weight * (positions[k, a] - positions[n - 1, a])
        ahead[3] += weight * factor * x
        ahead[4] += weight * factor * y
        ahead[5] += weight * factor * z
    small_rotation(ahead[3:], turn)
    return turn @ rotations[n - 1], positions[n - 1] + ahead[:3]


@numba.njit(cache=True, nogil=True)
def observe(
    rotation: Array,
    position: Array,
    motion: Array,
    T_camera_base: Array,
    points: Array,
    rays: Array,
    lags: Array,
    count: int,
    residual: Array,
    jacobian: Array,
    rates: Array,
    places: Array,
) -> bool:
    """Residuals (measured - predicted) of one observation; False when a point is behind.

    Args:
        rotation: R_base_platform, (3, 3).
        position: (3,).
        motion: v, w, a, al in the base frame, (12,).
        T_camera_base: (4, 4).
        points: platform coordinates, (4, 3).
        rays: measured x/z, y/z, (8,).
        lags: time of each point after the instant, (4,).
        count: points in use.
        residual: out, (8,).
        jacobian: out, of the prediction by dp, dr, (8, 6).
        rates: out, of the prediction by time, (8,).
        places: out, points in the camera frame, (4, 3).
    """
    turn = np.empty((3, 3))
    step = np.empty(3)
    camera = T_camera_base
    for k in range(count):
        dt = lags[k]
        for i in range(3):
            step[i] = motion[3 + i] * dt + 0.5 * motion[9 + i] * dt * dt
        small_rotation(step, turn)
        arm = turn @ (rotation @ points[k])
        velocity = np.empty(3)
        base = np.empty(3)
        spin0, spin1, spin2 = (
            motion[3] + motion[9] * dt,
            motion[4] + motion[10] * dt,
            motion[5] + motion[11] * dt,
        )
        for i in range(3):
            base[i] = position[i] + motion[i] * dt + 0.5 * motion[6 + i] * dt * dt + arm[i]
            velocity[i] = motion[i] + motion[6 + i] * dt
        velocity[0] += spin1 * arm[2] - spin2 * arm[1]
        velocity[1] += spin2 * arm[0] - spin0 * arm[2]
        velocity[2] += spin0 * arm[1] - spin1 * arm[0]
        for i in range(3):
            places[k, i] = (
                camera[i, 0] * base[0]
                + camera[i, 1] * base[1]
                + camera[i, 2] * base[2]
                + camera[i, 3]
            )
        z = places[k, 2]
        if not z > 1e-3:
            return False
        x, y = places[k, 0] / z, places[k, 1] / z
        residual[2 * k] = rays[2 * k] - x
        residual[2 * k + 1] = rays[2 * k + 1] - y
        for row in range(2):
            value = x if row == 0 else y
            g0 = (camera[row, 0] - value * camera[2, 0]) / z
            g1 = (camera[row, 1] - value * camera[2, 1]) / z
            g2 = (camera[row, 2] - value * camera[2, 2]) / z
            line = jacobian[2 * k + row]
            line[0], line[1], line[2] = g0, g1, g2
            # d base / d dr = -skew(arm): g' (dr x arm) = dr . (arm x g)
            line[3] = arm[1] * g2 - arm[2] * g1
            line[4] = arm[2] * g0 - arm[0] * g2
            line[5] = arm[0] * g1 - arm[1] * g0
            rates[2 * k + row] = g0 * velocity[0] + g1 * velocity[1] + g2 * velocity[2]
    return True


@numba.njit(cache=True, nogil=True)
def _whiten(
    white: Array, residual: Array, jacobian: Array, m: int, free: int, r: Array, j: Array
) -> None:
    """Gives W residual and W jacobian over the first m rows; W is lower triangular."""
    for i in range(m):
        r[i] = 0.0
        j[i] = 0.0
        for k in range(i + 1):
            r[i] += white[i, k] * residual[k]
            for c in range(free):
                j[i, c] += white[i, k] * jacobian[k, c]


@numba.njit(cache=True, nogil=True)
def solve_instant(
    rotation: Array,
    position: Array,
    motion: Array,
    free: int,
    cameras: Array,
    camera_of: Ints,
    points: Array,
    rays: Array,
    whitening: Array,
    lags: Array,
    counts: Ints,
    limit: float,
    passes: int,
    covariance: Array,
    scores: Array,
) -> float:
    """Robust pose of one instant, in place; `free` is 6, or 3 for the position alone.

    An observation whose mean squared whitened residual exceeds `limit` is weighed down by the
    square of the excess. Returns the smallest eigenvalue of the
    balanced normal matrix; 0 when it cannot be solved. `scores` (n,) takes each
    observation's mean squared whitened residual at the solution, -1 where behind the camera.
    """
    n = len(camera_of)
    residual, rates = np.zeros(8), np.zeros(8)
    jacobian, places = np.zeros((8, 6)), np.zeros((4, 3))
    turn, step = np.empty((3, 3)), np.zeros(6)
    condition = 0.0
    r, j = np.empty(8), np.empty((8, 6))
    normal, right = np.zeros((free, free)), np.zeros(free)
    for iteration in range(passes):
        normal[:] = 0.0
        right[:] = 0.0
        for o in range(n):
            m = 2 * counts[o]
            scores[o] = -1.0
            seen = observe(
                rotation,
                position,
                motion,
                cameras[camera_of[o]],
                points[o],
                rays[o],
                lags[o],
                counts[o],
                residual,
                jacobian,
                rates,
                places,
            )
            if not seen:
                continue
            _whiten(whitening[o], residual, jacobian, m, free, r, j)
            score = 0.0
            for i in range(m):
                score += r[i] * r[i] / m
            scores[o] = score
            bound = limit * 100.0 if iteration == 0 else limit
            weight = 1.0 if score <= bound else (bound / score) ** 2
            for i in range(m):
                for a in range(free):
                    right[a] += weight * j[i, a] * r[i]
                    for b in range(free):
                        normal[a, b] += weight * j[i, a] * j[i, b]
        scale = np.sqrt(np.diag(normal)) + 1e-300
        balanced = normal / np.outer(scale, scale)
        condition = float(np.linalg.eigvalsh(balanced)[0])
        if not condition > 1e-9:
            return 0.0
        step[:free] = np.linalg.solve(normal, right)
        position += step[:3]
        largest = np.abs(step[:free]).max()
        if free == 6:
            small_rotation(step[3:], turn)
            rotation[:] = turn @ rotation
        if largest < 1e-8 and iteration > 1:
            break
    covariance[:] = 0.0
    covariance[:free, :free] = np.linalg.inv(normal)
    return condition


@numba.njit(cache=True, nogil=True)
def solve_block(
    starts: Ints,
    rotations: Array,
    positions: Array,
    known: NDArray[np.bool_],
    motions: Array,
    free: int,
    cameras: Array,
    camera_of: Ints,
    points: Array,
    rays: Array,
    whitening: Array,
    lags: Array,
    counts: Ints,
    limit: float,
    covariances: Array,
    scores: Array,
) -> None:
    """`solve_instant` for each instant k of a block, observations starts[k] ... starts[k + 1]."""
    for k in range(len(starts) - 1):
        a, b = starts[k], starts[k + 1]
        if not known[k]:
            continue
        points_seen = 0
        for o in range(a, b):
            points_seen += counts[o]
        if points_seen < (3 if free == 6 else 2):
            known[k] = False
            continue
        condition = solve_instant(
            rotations[k],
            positions[k],
            motions[k],
            free,
            cameras,
            camera_of[a:b],
            points[a:b],
            rays[a:b],
            whitening[a:b],
            lags[a:b],
            counts[a:b],
            limit,
            np.int64(12),  # not a literal, for which it would be compiled once more
            covariances[k],
            scores[a:b],
        )
        if condition == 0.0:
            known[k] = False


@numba.njit(cache=True, nogil=True)
def linearise_block(
    starts: Ints,
    rotations: Array,
    positions: Array,
    known: NDArray[np.bool_],
    motions: Array,
    cameras: Array,
    camera_of: Ints,
    points: Array,
    rays: Array,
    lags: Array,
    counts: Ints,
    residuals: Array,
    jacobians: Array,
    rates: Array,
    places: Array,
) -> None:
    """`observe` for every observation of a block at its pose; zeros where there is none.

    Fills residuals (n, 8), jacobians (n, 8, 6), rates (n, 8) and places (n, 4, 3).
    """
    for k in range(len(starts) - 1):
        if not known[k]:
            continue
        for o in range(starts[k], starts[k + 1]):
            seen = observe(
                rotations[k],
                positions[k],
                motions[k],
                cameras[camera_of[o]],
                points[o],
                rays[o],
                lags[o],
                counts[o],
                residuals[o],
                jacobians[o],
                rates[o],
                places[o],
            )
            if not seen:
                residuals[o] = 0.0
                jacobians[o] = 0.0
                rates[o] = 0.0
