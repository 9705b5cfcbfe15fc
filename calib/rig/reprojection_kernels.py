"""Reprojection rows of one view: the adjustment's inner loop.

The board moves along a polynomial during one piece of a recording: with s the time from the
piece's middle over the problem's time scale,

    t(s) = t0 + sum v_j s^j,   R(s) = exp(w(s)) R0,   w(s) = sum w_j s^j,   j = 1 ... degree

so that a corner is predicted at the very time at which its row was exposed. A view without a lag
is of a board at rest: it is where it is at any time. With g the derivative
of a pixel by the corner's place in the base frame and a the corner's arm about the board's origin,
the derivative by a turn d of the board is d . (a x g); a turn of R0 arrives as exp(w) dr, a change
of w_j as s^j J(w) dw_j, J the left Jacobian of the rotation group (Chirikjian 2012, eq. 10.86).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from freeswing.calib.camera.lens_kernels import WITH_SLOPES, WITHOUT_SLOPES, lens_point
from freeswing.calib.rig.kernel_inputs import Array, Estimate, Ints, Shape, ViewArrays
from freeswing.cdpr.compiled.kernels import kernel

POSE, CLOCK, WARP = 6, 2, 3


class View(NamedTuple):
    """One view, what its camera is and how its board moves."""

    pixels: Array
    lag_s: float
    is_fisheye: bool
    full: Array
    columns: Ints
    n_lens: int
    R_camera: Array
    t_camera: Array
    clock: Array
    T_board: Array
    motion: Array
    scale_s: float
    shape: Shape


class _Carried(NamedTuple):
    """Scratch: the board carried to a row's time, with w and its rate, speed and spin."""

    R: Array
    t: Array
    turn: Array
    left: Array
    w: Array
    rate: Array
    speed: Array
    spin: Array


class _Point(NamedTuple):
    """Scratch: one corner's arm in base and camera, its place, pixel and their derivatives."""

    arm: Array
    arm_camera: Array
    place: Array
    pixel: Array
    d_point: Array
    d_full: Array


class Spare(NamedTuple):
    """Scratch of `view_rows`."""

    carried: _Carried
    point: _Point


@kernel
def turn_and_jacobian(w: Array, turn: Array, left: Array) -> tuple[Array, Array]:
    """exp(skew(w)) and its left Jacobian, (3, 3) each, in the arrays given.

    Source:
        Barfoot 2017, State Estimation for Robotics, sec. 7.1: the rotation of a vector and
        its left Jacobian, in series where the angle is small.
    """
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
    return turn, left


@kernel(forceinline=True)
def view_of(views: ViewArrays, estimate: Estimate, v: int) -> View:
    """View v with its own camera and board."""
    c, piece = views.camera[v], views.piece[v]
    lenses, places, boards, shape = estimate
    return View(
        views.pixels[v],
        views.lags_s[v],
        bool(lenses.fisheye[c]),
        lenses.full[c],
        lenses.columns[c],
        int(lenses.counts[c]),
        places.rotations[c],
        places.translations[c],
        places.clocks[c],
        boards.poses[piece],
        boards.motions[piece],
        boards.scale_s,
        shape,
    )


@kernel(forceinline=True)
def _carry(view: View, row_px: float, at: _Carried) -> float:
    """Carries the board to the time of an image row; gives that time in its scale."""
    T_board, motion = view.T_board, view.motion
    s = 0.0
    if math.isfinite(view.lag_s):
        s = (view.lag_s + view.clock[0] + row_px * view.clock[1]) / view.scale_s
    w, m = at.w, at.rate
    w[:], at.speed[:], m[:] = 0.0, 0.0, 0.0
    for i in range(3):  # slices would bring the text of an error about shapes into what is compiled
        at.t[i] = T_board[i, 3]
    power = 1.0
    for j in range(motion.shape[0]):
        for i in range(3):
            at.speed[i] += (j + 1) * power * motion[j, i] / view.scale_s
            m[i] += (j + 1) * power * motion[j, 3 + i] / view.scale_s
            at.t[i] += power * s * motion[j, i]
            w[i] += power * s * motion[j, 3 + i]
        power *= s
    turn, left = turn_and_jacobian(w, at.turn, at.left)
    for i in range(3):
        at.spin[i] = left[i, 0] * m[0] + left[i, 1] * m[1] + left[i, 2] * m[2]
        for j in range(3):
            at.R[i, j] = (
                turn[i, 0] * T_board[0, j] + turn[i, 1] * T_board[1, j] + turn[i, 2] * T_board[2, j]
            )
    return s


@kernel(forceinline=True)
def _see(view: View, at: _Carried, p: int, slopes: bool, seen: _Point) -> None:
    """Corner p of the board as the camera sees it."""
    point, R, t, R_camera = view.shape.points[p], at.R, at.t, view.R_camera
    arm, arm_camera = seen.arm, seen.arm_camera
    for i in range(3):
        arm[i] = R[i, 0] * point[0] + R[i, 1] * point[1] + R[i, 2] * point[2]
    for i in range(3):
        arm_camera[i] = (
            R_camera[i, 0] * (arm[0] + t[0])
            + R_camera[i, 1] * (arm[1] + t[1])
            + R_camera[i, 2] * (arm[2] + t[2])
        )
        seen.place[i] = arm_camera[i] + view.t_camera[i]
    lens_point(
        view.is_fisheye, view.full, seen.place, slopes, seen.pixel, seen.d_point, seen.d_full
    )


@kernel(forceinline=True)
def _fill_row(
    view: View, at: _Carried, s: float, p: int, seen: _Point, axis: int, row: Array
) -> None:
    """Derivatives of one coordinate of corner p by the view's local unknowns."""
    k, R, R_camera = view.n_lens, at.R, view.R_camera
    arm, arm_camera, modes = seen.arm, seen.arm_camera, view.shape.modes
    row[:] = 0.0
    for j in range(12):
        if view.columns[j] >= 0:
            row[view.columns[j]] += seen.d_full[axis, j]
    d0, d1, d2 = seen.d_point[axis, 0], seen.d_point[axis, 1], seen.d_point[axis, 2]
    row[k], row[k + 1], row[k + 2] = d0, d1, d2
    row[k + 3] = arm_camera[1] * d2 - arm_camera[2] * d1
    row[k + 4] = arm_camera[2] * d0 - arm_camera[0] * d2
    row[k + 5] = arm_camera[0] * d1 - arm_camera[1] * d0
    g0 = d0 * R_camera[0, 0] + d1 * R_camera[1, 0] + d2 * R_camera[2, 0]
    g1 = d0 * R_camera[0, 1] + d1 * R_camera[1, 1] + d2 * R_camera[2, 1]
    g2 = d0 * R_camera[0, 2] + d1 * R_camera[1, 2] + d2 * R_camera[2, 2]
    m0 = arm[1] * g2 - arm[2] * g1
    m1 = arm[2] * g0 - arm[0] * g2
    m2 = arm[0] * g1 - arm[1] * g0
    rate = 0.0
    rate += g0 * at.speed[0] + m0 * at.spin[0]
    rate += g1 * at.speed[1] + m1 * at.spin[1]
    rate += g2 * at.speed[2] + m2 * at.spin[2]
    row[k + POSE], row[k + POSE + 1] = rate, rate * view.pixels[p, 1]
    b0 = g0 * R[0, 0] + g1 * R[1, 0] + g2 * R[2, 0]
    b1 = g0 * R[0, 1] + g1 * R[1, 1] + g2 * R[2, 1]
    b2 = g0 * R[0, 2] + g1 * R[1, 2] + g2 * R[2, 2]
    first = k + POSE + CLOCK
    n_shape = modes.shape[2]
    for j in range(n_shape):
        row[first + j] = b0 * modes[p, 0, j] + b1 * modes[p, 1, j] + b2 * modes[p, 2, j]
    first += n_shape
    row[first], row[first + 1], row[first + 2] = g0, g1, g2
    for i in range(3):
        row[first + 3 + i] = m0 * at.turn[0, i] + m1 * at.turn[1, i] + m2 * at.turn[2, i]
    power = s
    for _ in range(view.motion.shape[0]):
        first += 6
        row[first], row[first + 1], row[first + 2] = power * g0, power * g1, power * g2
        for i in range(3):
            row[first + 3 + i] = power * (
                m0 * at.left[0, i] + m1 * at.left[1, i] + m2 * at.left[2, i]
            )
        power *= s


@kernel(forceinline=True)
def view_rows(
    view: View, with_rows: bool, rows: Array, residuals: Array, spare: Spare
) -> tuple[Array, Array]:
    """Minus the derivatives (2 n_points, n_local) and residuals (2 n_points,), in arrays given.

    Local columns are lens (k), pose (6), clock (2), shape (as many as modes), board
    (6 (degree + 1)). Corners that are not finite are skipped; rows are filled where `with_rows`
    says so.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, appendix 6:
        bundle adjustment.
    """
    pixels, at, seen = view.pixels, spare.carried, spare.point
    for i in range(3):
        at.t[i] = view.T_board[i, 3]
        for j in range(3):
            at.R[i, j] = view.T_board[i, j]
    s = 0.0
    placed = view.motion.shape[0] == 0
    for p in range(len(pixels)):
        if not math.isfinite(pixels[p, 0]):
            continue
        if not placed:
            s = _carry(view, pixels[p, 1], at)
            placed = view.clock[1] == 0.0
        _see(view, at, p, with_rows, seen)
        for axis in range(2):
            residuals[2 * p + axis] = pixels[p, axis] - seen.pixel[axis]
            if with_rows:
                _fill_row(view, at, s, p, seen, axis, rows[2 * p + axis])
    return rows, residuals


@kernel
def new_spare() -> Spare:
    """Scratch for views of boards that all rest or all move; those at rest leave the turn alone."""
    carried = _Carried(
        np.eye(3),
        np.zeros(3),
        np.eye(3),
        np.eye(3),
        np.zeros(3),
        np.zeros(3),
        np.zeros(3),
        np.zeros(3),
    )
    point = _Point(
        np.empty(3), np.empty(3), np.empty(3), np.empty(2), np.empty((2, 3)), np.empty((2, 12))
    )
    return Spare(carried, point)


@kernel
def local_rows(views: ViewArrays, estimate: Estimate, v: int) -> Array:
    """Minus the derivatives of view v by its local unknowns, (2 n_points, n_local).

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, appendix 6:
        bundle adjustment.
    """
    view = view_of(views, estimate, v)
    columns = (
        view.n_lens + POSE + CLOCK + view.shape.modes.shape[2] + 6 * (1 + view.motion.shape[0])
    )
    n = 2 * views.pixels.shape[1]
    return view_rows(view, WITH_SLOPES, np.zeros((n, columns)), np.zeros(n), new_spare())[0]


@kernel
def all_residuals(views: ViewArrays, estimate: Estimate) -> Array:
    """Residuals of all views in px, NaN where unseen, (n, n_points, 2)."""
    result = np.full(views.pixels.shape, np.nan)
    rows, spare = np.zeros((1, 1)), new_spare()
    for v in range(len(views.camera)):
        view_rows(view_of(views, estimate, v), WITHOUT_SLOPES, rows, result[v].reshape(-1), spare)
    return result
