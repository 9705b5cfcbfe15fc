"""Whether an image was overexposed or its lens covered, and so shows no tag."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]

_DARK_SPREAD = 5.0  # grey levels: a room has more, a covered lens only its noise
_SATURATED = 253.0  # of 255: what is brighter has been cut off
_BRIGHT_SHARE = 0.3  # of an image: a lamp and its reflections cover less


def is_saturated(grey: float) -> bool:
    """Whether a grey level, 0 to 255, was cut off."""
    return grey > _SATURATED


def is_overexposed(coarse: Image) -> bool:
    """Whether too much of some of an image's pixels was cut off."""
    return float(np.mean(coarse > _SATURATED)) > _BRIGHT_SHARE


def is_covered(coarse: Image) -> bool:
    """Whether some of an image's pixels differ by noise alone."""
    return float(coarse.std()) < _DARK_SPREAD
