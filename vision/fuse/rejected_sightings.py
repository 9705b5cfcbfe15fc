"""Which sightings a fusion rejects, since they do not agree with the poses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_REJECT = 16.0  # mean square: four deviations in all numbers of a sighting


def agreeing(scores: Array) -> Mask:
    """Which sightings agree with the poses, by their mean squared whitened residual, (n_o,)."""
    return (scores >= 0.0) & (scores < _REJECT)
