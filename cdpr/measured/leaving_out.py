"""How far numbers are off, by what they are without each of the parts that they came from."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.robot import Array


def leaving_out_std(without: Array) -> Array:
    """Standard deviations of numbers (k,) that were found without each of g parts in turn, (g, k).

    Source:
        Efron, Tibshirani 1993, An Introduction to the Bootstrap, ch. 11: the jackknife.
    """
    count = len(without)
    spread = without - without.mean(axis=0)
    return np.asarray(np.sqrt((count - 1) / count * np.sum(spread**2, axis=0)))
