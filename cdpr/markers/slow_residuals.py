"""Which part of the markers' residuals is slow, and how slow."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Neighbouring residuals of white noise correlate by chance: three deviations of that are none.
CHANCE = 3.0


def slow_share(residuals: Array, step_s: float) -> tuple[float, float]:
    """Share of the variance that neighbouring samples have in common, and its correlation time.

    White noise drops out of the product of neighbouring residuals, what is slow does not.

    Args:
        residuals: (n_t, n_m, 3), NaN where missing.
        step_s: time between samples.

    Returns:
        The share, 0 to 1, and the time in s after which the correlation has fallen to 1/e of that
        of neighbours; both 0 where neighbours correlate by no more than chance.
    """
    variance, count = _product(residuals, 0)
    if count == 0 or variance <= 0.0:
        return 0.0, 0.0
    near, n_near = _product(residuals, 1)
    if near <= CHANCE * variance / np.sqrt(max(n_near, 1)):
        return 0.0, 0.0
    lag, reached = 1, near
    while lag < len(residuals) // 2 and reached > near / np.e:
        lag = lag + max(1, lag // 8)
        reached, n_pairs = _product(residuals, lag)
        if n_pairs == 0:
            break
    return min(near / variance, 1.0), float(lag * step_s)


def _product(residuals: Array, lag: int) -> tuple[float, int]:
    """Mean product of residuals `lag` samples apart, and of how many it is."""
    products = residuals[lag:] * residuals[: len(residuals) - lag]
    known = np.isfinite(products)
    n = int(known.sum())
    return (float(products[known].mean()), n) if n else (0.0, 0)
