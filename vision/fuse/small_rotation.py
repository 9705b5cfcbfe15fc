"""Rotations by small vectors, inside compiled code."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel

Array = NDArray[np.float64]


@kernel
def small_rotation(r: Array, out: Array) -> Array:
    """exp(skew(r)) in `out` (3, 3), which is given back.

    Source:
        Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, ch. 2,
        eq. (2.14).
    """
    angle2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    angle = math.sqrt(angle2)
    if angle < 1e-6:
        a, b = 1.0 - angle2 / 6.0, 0.5 - angle2 / 24.0
    else:
        a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle2
    x, y, z = r[0], r[1], r[2]
    out[0, 0] = 1.0 - b * (y * y + z * z)
    out[1, 1] = 1.0 - b * (x * x + z * z)
    out[2, 2] = 1.0 - b * (x * x + y * y)
    out[0, 1], out[1, 0] = b * x * y - a * z, b * x * y + a * z
    out[0, 2], out[2, 0] = b * x * z + a * y, b * x * z - a * y
    out[1, 2], out[2, 1] = b * y * z - a * x, b * y * z + a * x
    return out
