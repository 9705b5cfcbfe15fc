"""Samples in which a marker contradicts the others far more than it usually does in its run.

A reflection taken for a marker for a third of a second turns the platform by 30 mrad there, and
three markers that are left cannot say which of them it was: such samples have no pose.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.markers.marker_jumps import JUMP_DEVIATIONS, Jump
from freeswing.cdpr.markers.spoiling_markers import Rigidity

# Below this it is the common drift of half-hidden markers, which the covariances hold.
STANDS_OUT_M = 5e-4
# Median length of a vector of three unit normal numbers.
MEDIAN_LENGTH = 1.538


def stand_outs(found: Rigidity) -> tuple[Jump, ...]:
    """Kept markers whose residuals stand out, the frames in which they do, and how far at most.

    Args:
        found: what a run's markers are worth.
    """
    residuals = found.residuals_m
    known: NDArray[np.bool_] = np.asarray(np.isfinite(residuals).all(axis=2))
    jumps = []
    for k in range(residuals.shape[1]):
        if k in found.left_out or not known[:, k].any():
            continue
        mine = residuals[known[:, k], k]
        away = np.linalg.norm(mine - np.median(mine, axis=0), axis=1)
        usual = float(np.median(away)) / MEDIAN_LENGTH
        far = away > max(JUMP_DEVIATIONS * usual, STANDS_OUT_M)
        if far.any():
            frames: NDArray[np.intp] = np.flatnonzero(known[:, k])[far]
            jumps.append(Jump(k, frames, float(away.max())))
    return tuple(jumps)
