"""How large the slow errors of lengths are, and how many independent ones a run holds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.lengths.length_rows import LengthRows

LARGEST_SIZE = 100.0
HALVINGS = 40


def slow_size(rows: Sequence[LengthRows], left: Sequence[Array], freedom: float) -> float:
    """Size of slow errors (times their stated or usual one) that explains what is left.

    Args:
        rows: of all runs.
        left: what the most general model leaves of them, (b, n) each.
        freedom: numbers less unknowns.

    Returns:
        The size with which white and slow noise together have a mean square of one; 0 where the
        white noise suffices.
    """

    def mean_square(size: float) -> float:
        total = 0.0
        for one, rest in zip(rows, left, strict=True):
            covariance = one.white + size**2 * one.slow
            total += float(np.einsum("bi,bi->", rest, _solved(covariance, rest)))
        return total / freedom

    if mean_square(0.0) <= 1.0:
        return 0.0
    low, high = 0.0, LARGEST_SIZE
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if mean_square(middle) > 1.0 else (low, middle)
    return high


def repetition(left: Sequence[Array]) -> float:
    """How many numbers say the same: 1 for white noise, more where few frequencies hold the power.

    The power's participation number, (sum P)^2 / sum P^2, is the number of frequencies that count;
    of white noise it is half their number, since a periodogram scatters by its own mean.

    Args:
        left: series (b, n) of the runs.
    """
    numbers, independent = 0.0, 0.0
    for series in left:
        power = np.abs(np.fft.rfft(series - series.mean(axis=0), axis=0)[1:]) ** 2
        total, squares = power.sum(axis=0), np.sum(power**2, axis=0)
        seen = squares > 0.0
        independent += float(np.sum(2.0 * total[seen] ** 2 / squares[seen]))
        numbers += float(len(power) * seen.sum())
    return max(1.0, numbers / independent) if independent > 0.0 else 1.0


def _solved(covariances: Array, vectors: Array) -> Array:
    return np.linalg.solve(covariances, vectors[..., None])[..., 0]
