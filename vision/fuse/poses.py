"""The platform's poses along a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


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
