"""Averages of runs of which some tell nothing: None where none does."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from freeswing.cdpr.robot import Array


def rms(numbers: Iterable[float]) -> float | None:
    """Root mean square of those that are known (finite); None: none is."""
    known = _known(numbers)
    return float(np.sqrt(np.mean(known**2))) if len(known) else None


def median(numbers: Iterable[float]) -> float | None:
    """Median of those that are known (finite); None: none is."""
    known = _known(numbers)
    return float(np.median(known)) if len(known) else None


def known_number(number: float) -> float | None:
    """A number as result files hold it: None where it is not known."""
    return float(number) if np.isfinite(number) else None


def _known(numbers: Iterable[float]) -> Array:
    every = np.array(list(numbers), dtype=np.float64)
    return every[np.isfinite(every)]
