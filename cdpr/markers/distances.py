"""How far markers are apart: on a rigid body the same, however it moves."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Pairs = NDArray[np.intp]


def pairs_of(n_markers: int) -> Pairs:
    """Indices of all pairs, (n_p, 2)."""
    return np.array(list(combinations(range(n_markers), 2)), dtype=np.intp).reshape(-1, 2)


def distances(points: Array, pairs: Pairs) -> Array:
    """Distances of pairs (n_p, 2) of points (..., n_m, 3), NaN where one is missing.

    Source:
        Golub, Van Loan 2013, Matrix Computations, sec. 2.2: the Euclidean norm.
    """
    return np.linalg.norm(points[..., pairs[:, 0], :] - points[..., pairs[:, 1], :], axis=-1)


def typical_distances(points: Array, pairs: Pairs) -> Array:
    """Medians over time, (n_p,), NaN for pairs never seen together."""
    return medians(distances(points, pairs))


def medians(values: Array) -> Array:
    """Medians over time of columns that may hold NaN, NaN where a column holds nothing.

    Source:
        Huber, Ronchetti 2009, Robust Statistics, sec. 1.4: the median, which few cannot move.
    """
    seen = np.isfinite(values)
    result = np.full(values.shape[1], np.nan)
    for k in np.flatnonzero(seen.any(axis=0)):
        result[k] = np.median(values[seen[:, k], k])
    return result
