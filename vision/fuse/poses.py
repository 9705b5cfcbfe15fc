"""The platform's poses along a run, and its motion from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.rotation import log_rotation

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_WINDOW = 5
_MOTIONS_AT_ONCE = 4000


@dataclass(frozen=True, slots=True)
class Poses:
    """The platform at the instants of a run.

    Attributes:
        times_s: base time, (n,).
        positions_m: NaN where unknown, (n, 3).
        rotations: R_base_platform, (n, 3, 3).
        covariances: of position and small rotation in the base frame, (n, 6, 6), or none (0, 6, 6).
        known: (n,).
        motions: velocity, angular velocity, and their rates in the base frame, (n, 12).
    """

    times_s: Array
    positions_m: Array
    rotations: Array
    covariances: Array
    known: Mask
    motions: Array


def unknown_poses(instants_s: Array) -> Poses:
    """Nothing known yet at some instants, (n,)."""
    n = len(instants_s)
    return Poses(
        instants_s,
        np.full((n, 3), np.nan),
        np.full((n, 3, 3), np.nan),
        np.zeros((0, 6, 6)),
        np.zeros(n, dtype=bool),
        np.zeros((n, 12)),
    )


def motion_of_poses(times_s: Array, positions: Array, rotations: Array, known: Mask) -> Array:
    """Velocity, angular velocity and their rates, (n, 12), from five neighbours.

    A quartic through the five poses, a parabola or a line where fewer are known: over a longer
    window a fast mode would be smoothed away, and with it the very motion that is sought.
    """
    n = len(times_s)
    motions = np.zeros((n, 12))
    if n < 2:
        return motions
    for low in range(0, n, _MOTIONS_AT_ONCE):
        rows = np.arange(low, min(low + _MOTIONS_AT_ONCE, n))
        motions[rows] = _motions_at(rows, times_s, positions, rotations, known)
    return motions


def _motions_at(
    rows: NDArray[np.int64], times_s: Array, positions: Array, rotations: Array, known: Mask
) -> Array:
    """Motions of some rows, (k, 12)."""
    n, motions = len(times_s), np.zeros((len(rows), 12))
    width = min(_WINDOW, n)
    first = np.clip(rows - width // 2, 0, n - width)
    index = first[:, None] + np.arange(width)
    usable = known[index] & known[rows][:, None] & (index != rows[:, None])
    relative = np.matmul(rotations[index], np.swapaxes(rotations[rows], 1, 2)[:, None])
    relative = np.where(usable[..., None, None], relative, np.eye(3))
    shifts = positions[index] - positions[rows][:, None]
    steps = np.concatenate([shifts, log_rotation(relative)], axis=-1)
    steps = np.where(usable[..., None], steps, 0.0)
    scale = float(np.median(np.diff(times_s)))
    dt = (times_s[index] - times_s[rows][:, None]) / scale
    count = usable.sum(axis=1)
    for degree, least in ((1, 1), (2, 2), (4, 4)):
        design = np.stack([dt ** (k + 1) for k in range(degree)], axis=-1)
        design = np.where(usable[..., None], design, 0.0)
        normal = np.einsum("nwa,nwb->nab", design, design)
        enough = count >= least
        normal[~enough] = np.eye(degree)
        found = np.linalg.solve(normal, np.einsum("nwa,nwc->nac", design, steps))
        motions[enough, :6] = found[enough, 0] / scale
        if degree > 1:
            motions[enough, 6:] = 2.0 * found[enough, 1] / scale**2
    return motions
