"""Normal equations of what is wrong with the rig, the platform's poses eliminated.

Eight numbers a camera: clock (s), line time (s a row) and a change of pose, translation then
rotation about the camera's axes (T_true = [exp(dr) R, t + dt]). Each instant's pose increment is
eliminated by its Schur complement, so that what all cameras could do together is no evidence.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

PER_CAMERA = 8
CLOCK, LINE, POSE = 0, 1, 2


@numba.njit(cache=True, nogil=True)
def add_rig_equations(
    starts: Ints,
    known: NDArray[np.bool_],
    camera_of: Ints,
    counts: Ints,
    residuals: Array,
    jacobians: Array,
    rates: Array,
    places: Array,
    offsets: Array,
    rows_px: Array,
    whitening: Array,
    weights: Array,
    normal: Array,
    right: Array,
) -> None:
    """Adds a block's instants to `normal` (8 n_c, 8 n_c) and `right` (8 n_c,).

    `offsets` (n_c, 3) are the cameras' translations t, `weights` (n_o,) those of the robust fit;
    the other arrays are those of `linearise_block`.
    """
    unknowns = normal.shape[0]
    pose_pose = np.zeros((6, 6))
    pose_rig = np.zeros((6, unknowns))
    pose_right = np.zeros(6)
    raw = np.zeros((8, 15))
    white = np.zeros((8, 15))
    for k in range(len(starts) - 1):
        if not known[k] or starts[k + 1] == starts[k]:
            continue
        pose_pose[:] = 0.0
        pose_rig[:] = 0.0
        pose_right[:] = 0.0
        for o in range(starts[k], starts[k + 1]):
            if weights[o] <= 0.0:
                continue
            m = 2 * counts[o]
            c = camera_of[o]
            for i in range(m):
                corner = i // 2
                place = places[o, corner]
                z = place[2]
                value = place[i % 2] / z
                g = np.zeros(3)
                g[i % 2] = 1.0 / z
                g[2] = -value / z
                arm0 = place[0] - offsets[c, 0]
                arm1 = place[1] - offsets[c, 1]
                arm2 = place[2] - offsets[c, 2]
                for a in range(6):
                    raw[i, a] = jacobians[o, i, a]
                raw[i, 6] = rates[o, i]
                raw[i, 7] = rates[o, i] * rows_px[o, corner]
                raw[i, 8], raw[i, 9], raw[i, 10] = g[0], g[1], g[2]
                raw[i, 11] = arm1 * g[2] - arm2 * g[1]
                raw[i, 12] = arm2 * g[0] - arm0 * g[2]
                raw[i, 13] = arm0 * g[1] - arm1 * g[0]
                raw[i, 14] = residuals[o, i]
            for i in range(m):
                for a in range(15):
                    total = 0.0
                    for b in range(i + 1):
                        total += whitening[o, i, b] * raw[b, a]
                    white[i, a] = total
            first = 8 * c
            for i in range(m):
                w = weights[o]
                r = w * white[i, 14]
                for a in range(6):
                    wa = w * white[i, a]
                    pose_right[a] += white[i, a] * r
                    for b in range(6):
                        pose_pose[a, b] += wa * white[i, b]
                    for b in range(8):
                        pose_rig[a, first + b] += wa * white[i, 6 + b]
                for a in range(8):
                    wa = w * white[i, 6 + a]
                    right[first + a] += white[i, 6 + a] * r
                    for b in range(8):
                        normal[first + a, first + b] += wa * white[i, 6 + b]
        for a in range(6):
            pose_pose[a, a] += 1e-12 * pose_pose[a, a] + 1e-12
        eliminated = np.linalg.solve(pose_pose, pose_rig)
        for a in range(unknowns):
            for b in range(unknowns):
                total = 0.0
                for i in range(6):
                    total += pose_rig[i, a] * eliminated[i, b]
                normal[a, b] -= total
            total = 0.0
            for i in range(6):
                total += eliminated[i, a] * pose_right[i]
            right[a] -= total
