"""The session's layout brought onto target.toml's, any marker of which may be the wrong one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.markers.layouts_aligned import Alignment, best_way, rigidly_moved, without_one
from freeswing.cdpr.measured.rigid_fit import is_planar_or_better

Array = NDArray[np.float64]


# target.toml from a drawing is not better than this.
TARGET_LEAST_STD_M = 2e-5
# A number in target.toml that is wrong is so by anything up to this, in one marker of twenty.
WRONG_BY_M = 0.02
WRONG_SHARE = 0.05
# With the scale estimated from three distances, chance makes odds of 20 often; of 150 in 1 %.
TARGET_CLEAR = 5.0


def align_to_target(points: Array, onto: Array) -> Alignment | None:
    """Bring a measured layout onto target.toml's, whose accuracy nobody has said.

    Every marker may be the one that is wrong: each subset is fitted by least squares, and its
    likelihood, the scale profiled, weighs how well it agrees against how much it leaves out.

    Args:
        points: what is moved, NaN where unknown, (n_m, 3).
        onto: target.toml's places, (n_m, 3).
    """
    known = np.asarray(np.isfinite(points).all(axis=1))
    if not is_planar_or_better(onto[known]):
        return None
    filled = np.where(known[:, None], points, 0.0)
    starts = without_one(onto, known.astype(float))
    moves = rigidly_moved(filled, np.broadcast_to(onto, (len(starts), *onto.shape)), starts)
    squares = np.sum(starts * np.sum((moves - onto) ** 2, axis=2), axis=1)
    freedom = 3.0 * starts.sum(axis=1) - 6.0
    scales = np.maximum(np.sqrt(squares / freedom), TARGET_LEAST_STD_M)
    fits = freedom * np.log(scales * np.sqrt(2.0 * np.pi)) + 0.5 * squares / scales**2
    out = known.sum() - starts.sum(axis=1)
    costs = fits + out * (3.0 * np.log(2.0 * WRONG_BY_M) - np.log(WRONG_SHARE))
    return best_way(moves, starts / scales[:, None] ** 2, costs, onto, known, TARGET_CLEAR)
