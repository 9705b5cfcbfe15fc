"""What runs of a bench scatter by in Izz beyond their noise, and whether it is any."""

from __future__ import annotations

import numpy as np

from freeswing.ident.likelihood.fit import Solution
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown

WIDE_SCATTER = 0.01  # of Izz: a run this far off is lost, not scattered
SIGNIFICANT = 2.71  # chi-square of one at 10 %: a scatter below is none


def scatter_block(runs: int, izz: float, std: float) -> Unknown:
    """What each run's Izz may be off by beyond its noise: rehanging, twisting, placing."""
    spread = np.full(runs, std)
    prior = Gaussian(np.zeros(runs), spread, "scatter between runs")
    return Unknown("scatter", np.zeros(runs), np.full(runs, 0.01 * izz), prior)


def scatter_std(found: Solution) -> float:
    """Standard deviation of what runs scatter by, from a fit with a wide prior for it; 0: none.

    The likelihood of the scatter alone, all else integrated out (Laird, Ware 1982).
    """
    values, covariance = found.value("scatter"), found.covariance_of("scatter")
    wide = float(found.unknowns.block("scatter").prior.std[0])  # type: ignore[union-attr]
    information = np.linalg.inv(covariance) - np.eye(len(values)) / wide**2
    pulled = np.linalg.inv(covariance) @ values
    sizes = wide * np.exp(np.linspace(-7.0, 0.0, 60))

    def cost(size: float) -> float:
        inside = np.eye(len(values)) + size**2 * information
        gain = pulled @ np.linalg.solve(information + np.eye(len(values)) / size**2, pulled)
        return float(np.linalg.slogdet(inside)[1] - gain)

    costs = np.array([cost(size) for size in sizes])
    best = int(np.argmin(costs))
    return float(sizes[best]) if costs[best] < -SIGNIFICANT else 0.0
