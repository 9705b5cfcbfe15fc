"""Board poses in one camera, view by view: damped Gauss-Newton on the reprojection error."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.lens_kernels import WITH_SLOPES, lens_point
from freeswing.calib.rig.reprojection_kernels import turn_and_jacobian
from freeswing.cdpr.compiled.kernels import kernel
from freeswing.cdpr.elimination import eliminate

Array = NDArray[np.float64]

_START_DAMPING = 1e-3
_SMALL_STEP = 1e-9
_LEAST_GAIN = 1e-10


@kernel
def _linearise(
    is_fisheye: bool,
    full: Array,
    points: Array,
    pixels: Array,
    pose: Array,
    normal: Array,
    slope: Array,
) -> float:
    """Normal equations (6, 6), (6,) of one pose, and its mean square error by axis."""
    normal[:], slope[:] = 0.0, 0.0
    pixel, d_point, d_full = np.empty(2), np.empty((2, 3)), np.empty((2, 12))
    arm, place, row = np.empty(3), np.empty(3), np.empty(6)
    squares = 0.0
    count = 0
    for p in range(len(points)):
        if not math.isfinite(pixels[p, 0]):
            continue
        for i in range(3):
            arm[i] = (
                pose[i, 0] * points[p, 0] + pose[i, 1] * points[p, 1] + pose[i, 2] * points[p, 2]
            )
            place[i] = arm[i] + pose[i, 3]
        lens_point(is_fisheye, full, place, WITH_SLOPES, pixel, d_point, d_full)
        for axis in range(2):
            d = d_point[axis]
            error = pixels[p, axis] - pixel[axis]
            row[0], row[1], row[2] = d[0], d[1], d[2]
            row[3] = arm[1] * d[2] - arm[2] * d[1]
            row[4] = arm[2] * d[0] - arm[0] * d[2]
            row[5] = arm[0] * d[1] - arm[1] * d[0]
            squares += error * error
            for i in range(6):
                slope[i] += row[i] * error
                for j in range(i + 1):
                    normal[i, j] += row[i] * row[j]
        count += 1
    for i in range(6):
        for j in range(i):
            normal[j, i] = normal[i, j]
    return squares / max(2 * count, 1) if math.isfinite(squares) else math.inf


@kernel
def polish_poses(
    is_fisheye: bool, full: Array, points: Array, pixels: Array, poses: Array, most_steps: int
) -> Array:
    """Refines `poses` (n, 4, 4) in place; root mean square error of each by axis, (n,).

    Infinite where a corner lies behind the camera. `pixels` (n, n_points, 2) may hold NaN.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, appendix 6:
        Levenberg-Marquardt on the reprojection error.
    """
    errors = np.empty(len(poses))
    normal, damped, slope = np.empty((6, 6)), np.empty((6, 6)), np.empty(6)
    new_normal, new_slope = np.empty((6, 6)), np.empty(6)
    step, turn, left = np.empty(6), np.eye(3), np.eye(3)
    trial = np.eye(4)
    for v in range(len(poses)):
        square = _linearise(is_fisheye, full, points, pixels[v], poses[v], normal, slope)
        damping = _START_DAMPING
        for _ in range(most_steps):
            if not math.isfinite(square):
                break
            for i in range(6):
                step[i] = slope[i]
                for j in range(6):
                    damped[i, j] = normal[i, j]
                damped[i, i] += damping * normal[i, i] + 1e-9
            eliminate(damped, step.reshape(-1, 1))
            turn_and_jacobian(step[3:], turn, left)
            for i in range(3):
                trial[i, 3] = poses[v, i, 3] + step[i]
                for j in range(3):
                    trial[i, j] = (
                        turn[i, 0] * poses[v, 0, j]
                        + turn[i, 1] * poses[v, 1, j]
                        + turn[i, 2] * poses[v, 2, j]
                    )
            new = _linearise(is_fisheye, full, points, pixels[v], trial, new_normal, new_slope)
            if new > square:
                damping *= 10.0
                continue
            gain, largest = square - new, 0.0
            for i in range(6):
                largest = max(largest, abs(step[i]))
            for i in range(3):
                for j in range(4):
                    poses[v, i, j] = trial[i, j]
            square = new
            normal, new_normal = new_normal, normal
            slope, new_slope = new_slope, slope
            damping *= 0.1
            if largest < _SMALL_STEP or gain < _LEAST_GAIN * square:
                break
        errors[v] = math.sqrt(square)
    return errors
