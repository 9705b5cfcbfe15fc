"""Normal equations of what is wrong with the rig, the platform's poses eliminated.

Eight numbers a camera: clock (s), line time (s a row) and a change of pose, translation then
rotation about the camera's axes (T_true = [exp(dr) R, t + dt]). Each instant's pose increment is
eliminated by its Schur complement, so that what all cameras could do together is no evidence.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel
from freeswing.cdpr.elimination import eliminate
from freeswing.vision.fuse.pose_kernels import Linear

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

PER_CAMERA = 8
CLOCK, LINE, POSE = 0, 1, 2
_OF_POSE = 6  # columns of a sighting's rows: the pose, then the camera's eight, then the residual
_ROWS = _OF_POSE + PER_CAMERA + 1


class RigSightings(NamedTuple):
    """Sightings of a block, those of instant k at starts[k] ... starts[k + 1].

    Attributes:
        starts: (n_k + 1,).
        known: instants whose pose is known, (n_k,).
        camera_of: (n_o,).
        counts: points of each, (n_o,).
        rows_px: image row of each point, (n_o, 4).
        whitening: (n_o, 8, 8).
        weights: of the robust fit, (n_o,).
    """

    starts: Ints
    known: NDArray[np.bool_]
    camera_of: Ints
    counts: Ints
    rows_px: Array
    whitening: Array
    weights: Array


class RigEquations(NamedTuple):
    """Normal matrix (8 n_c, 8 n_c) and right side (8 n_c,)."""

    normal: Array
    right: Array


class _PoseEquations(NamedTuple):
    """One instant's: by its pose (6, 6), with the rig's (6, 8 n_c), and right side (6,)."""

    normal: Array
    cross: Array
    right: Array


@kernel
def _rows_of(
    seen: RigSightings, linear: Linear, offsets: Array, o: int, raw: Array, white: Array
) -> int:
    """Whitened derivatives of sighting o by pose and camera, and residuals, into `white` (8, 15).

    `raw` (8, 15) is scratch. Gives the number of rows.
    """
    m = 2 * seen.counts[o]
    offset = offsets[seen.camera_of[o]]
    g = np.empty(3)
    for i in range(m):
        corner = i // 2
        place = linear.places[o, corner]
        z = place[2]
        g[:] = 0.0
        g[i % 2] = 1.0 / z
        g[2] = -(place[i % 2] / z) / z
        arm0, arm1, arm2 = place[0] - offset[0], place[1] - offset[1], place[2] - offset[2]
        for a in range(6):
            raw[i, a] = linear.jacobians[o, i, a]
        raw[i, 6] = linear.rates[o, i]
        raw[i, 7] = linear.rates[o, i] * seen.rows_px[o, corner]
        raw[i, 8], raw[i, 9], raw[i, 10] = g[0], g[1], g[2]
        raw[i, 11] = arm1 * g[2] - arm2 * g[1]
        raw[i, 12] = arm2 * g[0] - arm0 * g[2]
        raw[i, 13] = arm0 * g[1] - arm1 * g[0]
        raw[i, 14] = linear.residuals[o, i]
    for i in range(m):
        for a in range(_ROWS):
            total = 0.0
            for b in range(i + 1):
                total += seen.whitening[o, i, b] * raw[b, a]
            white[i, a] = total
    return m


@kernel
def _add_rows(
    white: Array, m: int, w: float, first: int, pose: _PoseEquations, rig: RigEquations
) -> None:
    """Adds m rows of weight w to an instant's equations and to those of the camera at `first`."""
    for i in range(m):
        r = w * white[i, 14]
        for a in range(6):
            wa = w * white[i, a]
            pose.right[a] += white[i, a] * r
            for b in range(6):
                pose.normal[a, b] += wa * white[i, b]
            for b in range(8):
                pose.cross[a, first + b] += wa * white[i, 6 + b]
        for a in range(8):
            wa = w * white[i, 6 + a]
            rig.right[first + a] += white[i, 6 + a] * r
            for b in range(8):
                rig.normal[first + a, first + b] += wa * white[i, 6 + b]


@kernel
def _eliminate(pose: _PoseEquations, rig: RigEquations) -> None:
    """Takes an instant's pose out of the rig's equations by its Schur complement."""
    unknowns = len(rig.right)
    for a in range(6):
        pose.normal[a, a] += 1e-12 * pose.normal[a, a] + 1e-12
    eliminated = eliminate(pose.normal, pose.cross.copy())
    for a in range(unknowns):
        for b in range(unknowns):
            total = 0.0
            for i in range(6):
                total += pose.cross[i, a] * eliminated[i, b]
            rig.normal[a, b] -= total
        total = 0.0
        for i in range(6):
            total += eliminated[i, a] * pose.right[i]
        rig.right[a] -= total


@kernel
def add_rig_equations(
    before: RigEquations, seen: RigSightings, linear: Linear, offsets: Array
) -> RigEquations:
    """The equations with a block's instants added.

    Args:
        before: the sum so far.
        seen: the block's sightings.
        linear: they about their poses.
        offsets: translation t of every camera's T_camera_base, (n_c, 3).
    """
    rig = RigEquations(before.normal.copy(), before.right.copy())
    unknowns = len(rig.right)
    pose = _PoseEquations(np.zeros((6, 6)), np.zeros((6, unknowns)), np.zeros(6))
    raw, white = np.zeros((8, _ROWS)), np.zeros((8, _ROWS))
    for k in range(len(seen.starts) - 1):
        if not seen.known[k] or seen.starts[k + 1] == seen.starts[k]:
            continue
        pose.normal[:], pose.cross[:], pose.right[:] = 0.0, 0.0, 0.0
        for o in range(seen.starts[k], seen.starts[k + 1]):
            if seen.weights[o] > 0.0:
                m = _rows_of(seen, linear, offsets, o, raw, white)
                first = PER_CAMERA * seen.camera_of[o]
                _add_rows(white, m, seen.weights[o], first, pose, rig)
        _eliminate(pose, rig)
    return rig
