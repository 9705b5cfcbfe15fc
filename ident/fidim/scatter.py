"""How far FIDIM's solution scatters, by what stretches of the runs say apart.

Eq. 33 takes all entries of the regressor for equally noisy. Equations are not: near a singularity
of the free coordinates a few of them outweigh all others, and what a smoother leaves of noise
repeats for a while. Leaving out one stretch at a time counts both.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.cdpr.measured.leaving_out import leaving_out_std
from freeswing.cdpr.robot import Array
from freeswing.ident.fidim.shares import Stack
from freeswing.ident.likelihood.between_runs import widened

# About the period of a swing, and twice a smoother's span: errors are others from there on.
CORRELATED_S = 1.0


def scattered(covariance: Array, stack: Stack, times_s: Sequence[Array]) -> Array:
    """A covariance with deviations raised to those between stretches, where chance does not do it.

    Args:
        covariance: of the nine values by the equations' scatter, (9, 9).
        stack: the runs' equations.
        times_s: their samples, a run each, (n,).

    Source:
        Kuensch 1989, The Jackknife and the Bootstrap for General Stationary Observations, sec. 2.
    """
    parts = []
    for rows, times in zip(stack.rows, times_s, strict=True):
        count = max(1, round((times[-1] - times[0]) / CORRELATED_S))
        # Equations of one sample stay together.
        samples = rows.reshape(len(times), -1, 10)
        parts += [part.reshape(-1, 10) for part in np.array_split(samples, count)]
    found = stack.without_each(parts)
    found = found[np.isfinite(found).all(axis=1)]
    if len(found) < 2:
        return covariance
    return widened(covariance, leaving_out_std(found), len(found))
