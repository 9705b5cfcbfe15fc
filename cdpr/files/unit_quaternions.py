"""How far from length 1 the four numbers may be that a file gives as a quaternion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.table_reader import Reader

Array = NDArray[np.float64]

# Recordings have two decimals and more; scaled or shuffled entries are off by more.
RECORDED_OFF = 0.02
DECLARED_OFF = 1e-3  # files of cameras, tags and wrenches are written with three decimals


def wrong_recorded(lengths: Array) -> NDArray[np.bool_]:
    """Which lengths (n,) are of no quaternion of a recording; unknown ones (NaN) are not."""
    return np.abs(lengths - 1.0) > RECORDED_OFF


def wrong_declared(lengths: Array) -> NDArray[np.bool_]:
    """Which lengths (n,) are of no quaternion that a file declares; unknown ones (NaN) are not."""
    return np.abs(lengths - 1.0) > DECLARED_OFF


def declared_quaternion(reader: Reader, key: str) -> Array:
    """A required quaternion of a table, (4,), normalised exactly; problems go to the reader."""
    return reader.unit_vector(key, 4, DECLARED_OFF)
