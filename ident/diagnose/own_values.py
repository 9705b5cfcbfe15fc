"""What effect values that each run has for itself are worth: they are tied by their size alone.

A fan has the same strength in all runs, and a phase that is new in each. Of such values nothing is
known but that those of all runs are of one size, which nobody has stated: it is whatever makes the
runs likeliest. Each value is then charged by the data of its own run: by how much they narrow it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from freeswing.cdpr.robot import Array

# Sizes that are tried: the likeliest is found to half a unit of evidence.
SIZES_A_DECADE = 10
# Of the deviation to which the best value is known: values that small change nothing.
SMALLEST_SIZE = 0.1


class OwnValues(NamedTuple):
    """What the runs know of them, over their plausible size, in units of what the fit leaves.

    Attributes:
        curves: inverse covariance by the data of each run, its state and frame free, (r, o, o).
        pulls: that times the likeliest values, (r, o).
        held: the size, over the plausible one, that values were found with, (r,).
    """

    curves: Array
    pulls: Array
    held: Array

    def log_evidence(self, weights: Array) -> Array:
        """Beside squares that were found with values of the size held, (d,).

        Args:
            weights: of the runs, (d, r).

        Source:
            MacKay 2003, Information Theory, Inference, and Learning Algorithms, ch. 28; the size as
            in Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.5: the likeliest.
        """
        return (weights @ self._by_size()[1].T).max(axis=1)

    def likeliest(self) -> tuple[float, Array]:
        """The likeliest size over the plausible one, and log densities of the runs by it, (r,).

        Source:
            Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.5: the evidence's maximum.
        """
        tried, by_run = self._by_size()
        best = int(np.argmax(by_run.sum(axis=1)))
        return float(tried[best]), by_run[best]

    def _by_size(self) -> tuple[Array, Array]:
        """Sizes that are tried, (s,), and log densities of the runs by them, (s, r)."""
        known, axes = np.linalg.eigh(self.curves)
        pulls = np.einsum("rab,ra->rb", axes, self.pulls)
        known = np.maximum(known, 0.0)
        tried = sizes(float(known.max()))
        scales = tried[:, None, None] ** 2
        narrowed = 1.0 + scales * known
        taken = 1.0 / (1.0 / self.held[:, None] ** 2 + known)
        fitted = pulls**2 * (scales / narrowed - taken)
        return tried, 0.5 * np.sum(fitted - np.log(narrowed), axis=2)


def sizes(known: float) -> Array:
    """Sizes of values over their plausible one that may be the likeliest, (s,), the largest one.

    Args:
        known: largest inverse variance to which the runs know a value over its plausible size.

    Source:
        Press et al. 2007, Numerical Recipes, sec. 10.1: a bracket, evenly in the logarithm.
    """
    least = min(SMALLEST_SIZE, SMALLEST_SIZE / np.sqrt(max(known, 1.0)))
    return np.geomspace(least, 1.0, round(-SIZES_A_DECADE * np.log10(least)) + 1)
