"""Other ways in which four numbers of a file may have been meant as an orientation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Of what is wrong as recorded, that the right reading leaves; a wrong one leaves as much again.
LEFT_OVER = 0.2


def _from_xyzw(q: Array) -> Array:
    return q[:, [3, 0, 1, 2]]


def _conjugate(q: Array) -> Array:
    return q * np.array([1.0, -1.0, -1.0, -1.0])


READINGS: dict[str, tuple[Callable[[Array], Array], str]] = {
    "quaternions stand as x y z w": (
        _from_xyzw,
        "the columns are qw, qx, qy, qz: write w into qw, or exchange the names in the header",
    ),
    "orientations are those of the base in the platform": (
        _conjugate,
        "turn the signs of qx, qy, qz: T_base_platform takes platform to base coordinates",
    ),
    "quaternions stand as x y z w, of the base in the platform": (
        lambda q: _conjugate(_from_xyzw(q)),
        "write w into qw and turn the signs of qx, qy, qz",
    ),
}
"""Each with what makes w, x, y, z of it, (n, 4), and what to do."""
