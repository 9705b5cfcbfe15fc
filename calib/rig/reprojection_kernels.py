"""Reprojection rows of one view after another, whitened and weighted: the adjustment's inner loop.

The board moves along a polynomial during one piece of a recording: with s the time from the
piece's middle over the problem's time scale,

    t(s) = t0 + sum v_j s^j,   R(s) = exp(w(s)) R0,   w(s) = sum w_j s^j,   j = 1 ... degree

so that a corner is predicted at the very time at which its row was exposed. With g the derivative
of a pixel by the corner's place in the base frame and a the corner's arm about the board's origin,
the derivative by a turn d of the board is d . (a x g); a turn of R0 arrives as exp(w) dr, a change
of w_j as s^j J(w) dw_j, J the left Jacobian of the rotation group (Chirikjian 2012, eq. 10.86).
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.lens_kernels import lens_point

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

POSE, CLOCK, WARP = 6, 2, 3


@numba.njit(cache=True, nogil=True)
def turn_and_jacobian(w: Array, turn: Array, left: Array) -> None:
    """exp(skew(w)) into `turn` and its left Jacobian into `left`, (3, 3) each."""
    square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    angle = math.sqrt(square)
    if angle < 1e-4:
        a, b, c = 1.0 - square / 6.0, 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    else:
        a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
        c = (1.0 - a) / square
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for m in range(3):
            outer = w[i] * w[m]
            turn[i, m] = b * outer
            left[i, m] = c * outer
        turn[i, i] += 1.0 - b * square
        left[i, i] += 1.0 - c * square
        turn[i, k] += a * w[j]
        turn[i, j] -= a * w[k]
        left[i, k] += b * w[j]
        left[i, j] -= b * w[k]


@numba.njit(cache=True, nogil=True)
def view_rows(
    pixels: Array,
    lag_s: float,
    lens: tuple[bool, Array, Ints, int],
    place: tuple[Array, Array, Array],
    board: tuple[Array, Array, float],
    shape: tuple[Array, Array],
    with_rows: bool,
    rows: Array,
    residuals: Array,
) -> None:
    """Residuals (2 n_points,) of one view and minus their derivatives, (2 n_points, n_local).

    Local columns are lens (k), pose (6), clock (2), warp (3), board (6 (degree + 1)). Corners that
    are not finite are skipped.

    Args:
        pixels: corners, (n_points, 2).
        lag_s: the view's stamp from the piece's middle.
        lens: fisheye or not, full parameters (12,), their columns (12,), their number.
        place: the camera's rotation (3, 3) and translation (3,), its clock offset and line time.
        board: T_base_board (4, 4) at the piece's middle, its motion (degree, 6), the time scale.
        shape: board points (n_points, 3), and their derivatives by the warp (n_points, 3, 3).
        with_rows: whether derivatives are wanted.
        rows: out.
        residuals: out.
    """
    is_fisheye, full, columns, k = lens
    R_camera, t_camera, clock = place
    T_board, motion, scale_s = board
    points, modes = shape
    degree = motion.shape[0]
    pixel, d_point, d_full = np.empty(2), np.empty((2, 3)), np.empty((2, 12))
    turn, left, R = np.eye(3), np.eye(3), T_board[:3, :3].copy()
    t = T_board[:3, 3].copy()
    w, speed, spin = np.zeros(3), np.zeros(3), np.zeros(3)
    arm, arm_camera, seen = np.empty(3), np.empty(3), np.empty(3)
    g, m, gR = np.empty(3), np.empty(3), np.empty(3)
    s = 0.0
    placed = degree == 0
    for p in range(len(pixels)):
        if not math.isfinite(pixels[p, 0]):
            continue
        if not placed:
            s = (lag_s + clock[0] + pixels[p, 1] * clock[1]) / scale_s
            w[:], speed[:] = 0.0, 0.0
            t[:], m[:] = T_board[:3, 3], 0.0
            power = 1.0
            for j in range(degree):
                for i in range(3):
                    speed[i] += (j + 1) * power * motion[j, i] / scale_s
                    m[i] += (j + 1) * power * motion[j, 3 + i] / scale_s
                    t[i] += power * s * motion[j, i]
                    w[i] += power * s * motion[j, 3 + i]
                power *= s
            turn_and_jacobian(w, turn, left)
            for i in range(3):
                spin[i] = left[i, 0] * m[0] + left[i, 1] * m[1] + left[i, 2] * m[2]
                for j in range(3):
                    R[i, j] = (
                        turn[i, 0] * T_board[0, j]
                        + turn[i, 1] * T_board[1, j]
                        + turn[i, 2] * T_board[2, j]
                    )
            placed = clock[1] == 0.0
        for i in range(3):
            arm[i] = R[i, 0] * points[p, 0] + R[i, 1] * points[p, 1] + R[i, 2] * points[p, 2]
        for i in range(3):
            arm_camera[i] = (
                R_camera[i, 0] * (arm[0] + t[0])
                + R_camera[i, 1] * (arm[1] + t[1])
                + R_camera[i, 2] * (arm[2] + t[2])
            )
            seen[i] = arm_camera[i] + t_camera[i]
        lens_point(is_fisheye, full, seen, with_rows, pixel, d_point, d_full)
        residuals[2 * p] = pixels[p, 0] - pixel[0]
        residuals[2 * p + 1] = pixels[p, 1] - pixel[1]
        if not with_rows:
            continue
        for axis in range(2):
            row = rows[2 * p + axis]
            row[:] = 0.0
            for j in range(12):
                if columns[j] >= 0:
                    row[columns[j]] += d_full[axis, j]
            d = d_point[axis]
            row[k], row[k + 1], row[k + 2] = d[0], d[1], d[2]
            row[k + 3] = arm_camera[1] * d[2] - arm_camera[2] * d[1]
            row[k + 4] = arm_camera[2] * d[0] - arm_camera[0] * d[2]
            row[k + 5] = arm_camera[0] * d[1] - arm_camera[1] * d[0]
            for i in range(3):
                g[i] = d[0] * R_camera[0, i] + d[1] * R_camera[1, i] + d[2] * R_camera[2, i]
            m[0] = arm[1] * g[2] - arm[2] * g[1]
            m[1] = arm[2] * g[0] - arm[0] * g[2]
            m[2] = arm[0] * g[1] - arm[1] * g[0]
            rate = 0.0
            for i in range(3):
                rate += g[i] * speed[i] + m[i] * spin[i]
                gR[i] = g[0] * R[0, i] + g[1] * R[1, i] + g[2] * R[2, i]
            at = k + POSE
            row[at], row[at + 1] = rate, rate * pixels[p, 1]
            at += CLOCK
            for j in range(WARP):
                row[at + j] = (
                    gR[0] * modes[p, 0, j] + gR[1] * modes[p, 1, j] + gR[2] * modes[p, 2, j]
                )
            at += WARP
            for i in range(3):
                row[at + i] = g[i]
                row[at + 3 + i] = m[0] * turn[0, i] + m[1] * turn[1, i] + m[2] * turn[2, i]
            power = s
            for _ in range(degree):
                at += 6
                for i in range(3):
                    row[at + i] = power * g[i]
                    row[at + 3 + i] = power * (
                        m[0] * left[0, i] + m[1] * left[1, i] + m[2] * left[2, i]
                    )
                power *= s


@numba.njit(cache=True, nogil=True)
def _whiten(factor: Array, block: Array, spare: Array) -> None:
    """Block <- factor @ block, for a lower triangle."""
    size = len(factor)
    for i in range(size - 1, -1, -1):
        spare[:] = 0.0
        for j in range(i + 1):
            f = factor[i, j]
            if f != 0.0:
                for c in range(block.shape[1]):
                    spare[c] += f * block[j, c]
        block[i] = spare


@numba.njit(cache=True, nogil=True)
def add_views(
    camera_of: Ints,
    piece_of: Ints,
    pixels: Array,
    lags_s: Array,
    whitening: Array,
    sigma: Array,
    knee: float,
    lenses: tuple[Flags, Array, Ints, Ints, Ints],
    places: tuple[Array, Array, Array],
    boards: tuple[Array, Array, float],
    shape: tuple[Array, Array],
    warp_at: int,
    normal: tuple[Array, Array, Array, Array, Array],
) -> float:
    """Adds all views to the normal equations and gives their robust cost.

    Args:
        camera_of: camera of each view, rising, (n,).
        piece_of: the piece of the board's motion, (n,).
        pixels: (n, n_points, 2).
        lags_s: (n,).
        whitening: lower triangles of each group of corners seen alike, (n, n_groups, 2c, 2c).
        sigma: each camera's noise, px, (n_cameras,).
        knee: of Huber's loss, for the length of a group's whitened residual over sigma.
        lenses: fisheye, full parameters, columns, number of parameters and first unknown by camera.
        places: rotations, translations and clocks by camera.
        boards: T_base_boards (n_pieces, 4, 4), motions (n_pieces, degree, 6), time scale.
        shape: as for `view_rows`.
        warp_at: first column of the warp among the shared unknowns.
        normal: in and out: shared (p, p), cross (n_pieces, p, b), boards (n_pieces, b, b),
            shared slope (p,), board slopes (n_pieces, b).
    """
    shared, cross, blocks, slope, board_slopes = normal
    n_points, n_groups = pixels.shape[1], whitening.shape[1]
    size = whitening.shape[2]
    width = blocks.shape[1]
    residuals = np.zeros(2 * n_points)
    local = 0
    rows = np.zeros((1, 1))
    spare = np.zeros(1)
    cost = 0.0
    for v in range(len(camera_of)):
        c, piece = camera_of[v], piece_of[v]
        k = lenses[3][c]
        wide = k + POSE + CLOCK + WARP + width + 1
        if wide != local:
            local = wide
            rows = np.zeros((2 * n_points, local))
            spare = np.zeros(local)
        target = np.empty(k + POSE + CLOCK + WARP, dtype=np.int64)
        for j in range(k + POSE + CLOCK):
            target[j] = lenses[4][c] + j
        for j in range(WARP):
            target[k + POSE + CLOCK + j] = warp_at + j
        view_rows(
            pixels[v],
            lags_s[v],
            (bool(lenses[0][c]), lenses[1][c], lenses[2][c], int(k)),
            (places[0][c], places[1][c], places[2][c]),
            (boards[0][piece], boards[1][piece], boards[2]),
            shape,
            True,
            rows,
            residuals,
        )
        used = 0
        for group in range(n_groups):
            first = group * size
            if not math.isfinite(pixels[v, first // 2, 0]):
                continue
            block = rows[used : used + size]
            if used != first:
                block[:] = rows[first : first + size]
            block[:, local - 1] = residuals[first : first + size]
            _whiten(whitening[v, group], block, spare)
            square = 0.0
            for i in range(size):
                square += block[i, local - 1] ** 2
            error = math.sqrt(square) / float(sigma[c])
            if not math.isfinite(error):
                return math.inf
            weight = 1.0 / float(sigma[c])
            if error > knee:
                cost += knee * error - 0.5 * knee * knee
                weight *= math.sqrt(knee / error)
            else:
                cost += 0.5 * error * error
            block *= weight
            used += size
        some = rows[:used]
        gram = np.dot(some.T, some)
        n_shared = len(target)
        for i in range(n_shared):
            a = target[i]
            slope[a] += gram[i, local - 1]
            for j in range(n_shared):
                shared[a, target[j]] += gram[i, j]
            for j in range(width):
                cross[piece, a, j] += gram[i, n_shared + j]
        for i in range(width):
            board_slopes[piece, i] += gram[n_shared + i, local - 1]
            for j in range(width):
                blocks[piece, i, j] += gram[n_shared + i, n_shared + j]
    return cost


@numba.njit(cache=True, nogil=True)
def all_residuals(
    camera_of: Ints,
    piece_of: Ints,
    pixels: Array,
    lags_s: Array,
    lenses: tuple[Flags, Array, Ints, Ints, Ints],
    places: tuple[Array, Array, Array],
    boards: tuple[Array, Array, float],
    shape: tuple[Array, Array],
) -> Array:
    """Residuals of all views in px, NaN where unseen, (n, n_points, 2)."""
    result = np.full(pixels.shape, np.nan)
    rows = np.zeros((1, 1))
    for v in range(len(camera_of)):
        c, piece = camera_of[v], piece_of[v]
        view_rows(
            pixels[v],
            lags_s[v],
            (bool(lenses[0][c]), lenses[1][c], lenses[2][c], int(lenses[3][c])),
            (places[0][c], places[1][c], places[2][c]),
            (boards[0][piece], boards[1][piece], boards[2]),
            shape,
            False,
            rows,
            result[v].reshape(-1),
        )
    return result
