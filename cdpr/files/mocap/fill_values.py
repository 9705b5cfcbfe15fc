"""How other programs write a marker that was not seen: 0 0 0, 9999999, blank, NaN."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Fill values are nines to seven places or more; no laboratory reaches 1000 km in any unit.
LEAST_FILL = 999999.0


def without_gaps(positions: Array, names: tuple[str, ...]) -> tuple[Array, tuple[str, ...]]:
    """Positions in the file's unit (n_t, n_m, 3) with NaN where a fill value stands, and notes.

    0 0 0 to the last digit is a fill value: a marker that is there has noise. It is not one where
    the marker is nowhere else, as a simulated reference point may be.
    """
    zero = (positions == 0.0).all(axis=2)
    zero[:, (zero | ~np.isfinite(positions).all(axis=2)).all(axis=0)] = False
    nines = np.abs(positions)
    with np.errstate(invalid="ignore"):
        filled = ((nines >= LEAST_FILL) & _is_nines(nines)).any(axis=2)
    result = np.where((zero | filled)[..., None], np.nan, positions)
    result[np.isnan(result).any(axis=2)] = np.nan
    notes = [
        f"{what} is taken as a gap in {count}"
        for what, gaps in (("0 0 0", zero), ("9999999", filled))
        if (count := _counts(np.asarray(gaps), names))
    ]
    return result, tuple(notes)


def _is_nines(values: Array) -> NDArray[np.bool_]:
    """9999999, also with decimals (9999999.9), as float32 has it too (1e7)."""
    finite = np.where(np.isfinite(values), values, 1.0)
    exponent = np.log10(np.maximum(finite, 1.0))
    return np.abs(exponent - np.round(exponent)) < 1e-6


def _counts(gaps: NDArray[np.bool_], names: tuple[str, ...]) -> str:
    found = zip(names, gaps.sum(axis=0), strict=True)
    return ", ".join(f"{count} samples of {name}" for name, count in found if count)
