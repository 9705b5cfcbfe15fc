"""The Gaussian's integral and density from tables: the edges of a blurred pattern, fast."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel

Array = NDArray[np.float64]

_REACH = 4.0
_STEPS_PER_UNIT = 256


def _gaussian_tables() -> tuple[Array, Array]:
    at = np.arange(-_REACH - 1, _REACH + 1 + 1.5 / _STEPS_PER_UNIT, 1.0 / _STEPS_PER_UNIT)
    step = np.array([0.5 * (1.0 + math.erf(v / math.sqrt(2.0))) for v in at])
    return step, np.exp(-0.5 * at**2) / math.sqrt(2.0 * math.pi)


_STEP, _BELL = _gaussian_tables()


@kernel(inline="always")
def gaussian_edge(z: float, step: Array, bell: Array) -> tuple[float, float]:
    """Gaussian integral and density at z, from tables."""
    if z >= _REACH:
        return 1.0, 0.0
    if z <= -_REACH:
        return 0.0, 0.0
    place = (z + _REACH + 1.0) * _STEPS_PER_UNIT
    k = int(place)
    f = place - k
    return step[k] + f * (step[k + 1] - step[k]), bell[k] + f * (bell[k + 1] - bell[k])


TABLES = np.stack([_STEP, _BELL])
