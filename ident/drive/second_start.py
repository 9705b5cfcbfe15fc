"""How far off an estimate a second search starts, which has to end at the same minimum."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SECOND_START = 1.05  # by which every number is off there, up and down in turn


def away(values: Array, held: int = 0) -> Array:
    """The numbers (k,) off by that, the first `held` of them as they are."""
    factors = np.where(np.arange(len(values)) % 2 == 0, SECOND_START, 1.0 / SECOND_START)
    factors[:held] = 1.0
    return np.asarray(values * factors, dtype=np.float64)
