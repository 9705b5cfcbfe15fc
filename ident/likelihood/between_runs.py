"""What runs say apart: deviations that need no model of the noise.

Residuals of a model that misses something follow the swing. They repeat with it, so that neither a
run's samples nor its periods are independent; what whole runs say apart counts all of that. The
jackknife (Efron, Tibshirani 1993, ch. 11) leaves out one run at a time, in the linear problem.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import chdtri

from freeswing.cdpr.measured.leaving_out import leaving_out_std
from freeswing.cdpr.robot import Array

LEAST_RUNS = 3  # of two, leaving out one leaves one: nothing it could be compared with
# Runs scatter by chance too: only a variance that chance exceeds once in twenty replaces another.
CHANCE = 0.05


def jackknife_std(runs: Sequence[Array], priors: Array, free: np.ndarray, unit: Array) -> Array:
    """Standard deviations of the shared unknowns by leaving out one run at a time, (p,).

    Args:
        runs: each run's rows over [shared unknowns; residual], (n, p + 1).
        priors: rows of what is known beforehand, (q, p + 1).
        free: which unknowns are estimated, (p,).
        unit: scales of the unknowns, (p,).

    Returns:
        Zero where nothing is estimated, and throughout where there are fewer than three runs.

    Source:
        Efron, Tibshirani 1993, An Introduction to the Bootstrap, ch. 11.
    """
    found, count = np.zeros(len(free)), len(runs)
    if count < LEAST_RUNS or not free.any():
        return found
    places = np.append(np.flatnonzero(free), len(free))
    scales = np.append(unit[free], 1.0)
    grams = np.array([part.T @ part for part in (one[:, places] * scales for one in runs)])
    known = priors[:, places] * scales
    total = grams.sum(axis=0) + known.T @ known
    changes = np.array([_solved(total - gram) for gram in grams])
    found[free] = unit[free] * leaving_out_std(changes)
    return found


def widened(covariance: Array, std: Array, runs: int) -> Array:
    """A covariance with deviations raised to those between runs, where chance does not do that.

    Args:
        covariance: (p, p), the correlations of which stay.
        std: between runs, (p,).
        runs: how many there are.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, sec. 4.2; the
        limit by chi-square: Press et al. 2007, Numerical Recipes, sec. 15.1.
    """
    own = np.sqrt(np.diag(covariance))
    if runs < LEAST_RUNS or not np.isfinite(own).all():
        return covariance
    ratio = np.where(own > 0.0, std / np.where(own > 0.0, own, 1.0), 0.0)
    limit = float(chdtri(runs - 1, CHANCE)) / (runs - 1)
    factors = np.where(ratio**2 > limit, ratio, 1.0)
    return covariance * np.outer(factors, factors)


def _solved(gram: Array) -> Array:
    return -np.linalg.lstsq(gram[:-1, :-1], gram[:-1, -1], rcond=None)[0]
