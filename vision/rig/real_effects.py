"""Which clocks, line times and moves of a rig are real: surely not zero, and not too small."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


# A rig has two dozen numbers that could be off, deviations are good to some ten percent, and what
# is changed for nothing spoils every pose: six of them leave no room for chance.
SIGMAS = 6.0


# Stamps are told to 0.1 ms at best, and 50 us of a swing at 0.5 m/s are 25 um: below all noise.
LEAST_CLOCK_S = 5e-5
# The same over an image of 200 rows and more.
LEAST_LINE_S = 3e-7


def is_real(values: Array, deviations: Array, least: float) -> NDArray[np.bool_]:
    """Which values are surely not zero, and large enough to matter.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3: deviations of a
        Gaussian.
    """
    return np.abs(values) > np.maximum(least, SIGMAS * deviations)
