"""Gauss-Legendre collocation of q'' = f(t, q, q'): the polynomial tables it needs.

On a segment of length h the acceleration is a polynomial through its values at the m Gauss nodes;
velocity and position are its exact integrals. The end point is of order 2 m.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre

from freeswing.cdpr.robot import Array


@dataclass(frozen=True, slots=True)
class Table:
    """Linear maps from node accelerations, on the unit segment.

    Attributes:
        nodes: Gauss nodes in (0, 1), (m,).
        once: first integrals at the nodes, (m, m).
        twice: second integrals at the nodes, (m, m).
        once_end: first integral at 1, (m,).
        twice_end: second integral at 1, (m,).
        spectrum: Legendre coefficients of the acceleration, (m, m).
    """

    nodes: Array
    once: Array
    twice: Array
    once_end: Array
    twice_end: Array
    spectrum: Array


@cache
def _integral_coefficients(orders: int, times: int) -> Array:
    """Legendre coefficients of `_integrated`'s columns, (orders + times, orders)."""
    return legendre.legint(np.eye(orders), m=times, lbnd=-1, scl=0.5)


def _integrated(orders: int, fractions: Array, times: int) -> Array:
    """Shifted Legendre polynomials 0..orders-1 integrated `times` from 0, (n, orders)."""
    coefficients = _integral_coefficients(orders, times)
    return legendre.legvander(2 * fractions - 1, orders + times - 1) @ coefficients


@cache
def table(m: int) -> Table:
    """The table for m nodes."""
    x, weights = legendre.leggauss(m)
    nodes = (x + 1) / 2
    orders = np.arange(m)
    spectrum = (2 * orders[:, None] + 1) / 2 * legendre.legvander(x, m - 1).T * weights
    end = np.array([1.0])
    return Table(
        nodes=nodes,
        once=_integrated(m, nodes, 1) @ spectrum,
        twice=_integrated(m, nodes, 2) @ spectrum,
        once_end=(_integrated(m, end, 1) @ spectrum)[0],
        twice_end=(_integrated(m, end, 2) @ spectrum)[0],
        spectrum=spectrum,
    )


def interpolation(m: int, fractions: Array) -> tuple[Array, Array, Array]:
    """Maps from node accelerations to acceleration, velocity and position at fractions (n,).

    Returns:
        Three (n, m) arrays that belong to all callers: values, first and second integrals, of the
        unit segment.

    Source:
        Hairer, Norsett, Wanner 1993, Solving Ordinary Differential Equations I, sec. II.7.
    """
    return _interpolation(m, np.asarray(fractions, dtype=np.float64).tobytes())


@lru_cache(maxsize=64)
def _interpolation(m: int, fractions: bytes) -> tuple[Array, Array, Array]:
    """A fit asks for the same instants of its segments in each of its steps."""
    spectrum = table(m).spectrum
    basis = legendre.legvander(2 * np.frombuffer(fractions) - 1, m + 1)
    values, once, twice = (
        basis[:, : m + k] @ (_integral_coefficients(m, k) @ spectrum) for k in range(3)
    )
    for part in (values, once, twice):
        part.flags.writeable = False
    return values, once, twice


def of_segments(weights: Array, parts: Array, index: np.ndarray) -> Array:
    """Each row of weights (n, q) times the parts (s, q, c) of its segment, (n, c).

    Args:
        weights: such as those of `interpolation`.
        parts: what they weigh.
        index: the segment of each row, (n,); quickest where neighbours share one.

    Source:
        Hairer, Norsett, Wanner 1993, Solving Ordinary Differential Equations I, sec. II.6:
        continuous output.
    """
    found = np.empty((len(index), parts.shape[-1]))
    edges = [0, *(np.flatnonzero(np.diff(index)) + 1).tolist(), len(index)]
    for first, last in pairwise(edges):
        if last > first:
            np.matmul(weights[first:last], parts[index[first]], out=found[first:last])
    return found
