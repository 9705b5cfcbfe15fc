"""Free coordinates against full poses (FIDIM 2022, eqs. 48, 49), with z-scores."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.robot import INERTIA_NAMES, Array


@dataclass(frozen=True, slots=True)
class ParameterComparison:
    """One parameter by two ways.

    Attributes:
        name: out of `INERTIA_NAMES`.
        difference_percent: of full against free, relative to free (eq. 48).
        std_percent: of the free estimate: what the paper sets beside the difference (eq. 49).
        z: the difference over both standard deviations together, signed full minus free.
    """

    name: str
    difference_percent: float
    std_percent: float
    z: float


def compare(
    free: Array, free_std: Array, full: Array, full_std: Array, shown: NDArray[np.bool_]
) -> tuple[ParameterComparison, ...]:
    """Compare nine parameters, (9,) each, where `shown`.

    The runs are the same for both, so that their errors are correlated and z is too small where
    noise dominates; a large z says that the two models disagree, whatever the noise.
    """
    rows = []
    for i in np.flatnonzero(shown):
        difference = float(full[i] - free[i])
        spread = float(np.hypot(free_std[i], full_std[i]))
        rows.append(
            ParameterComparison(
                INERTIA_NAMES[i],
                100.0 * abs(difference / free[i]) if free[i] else float("inf"),
                100.0 * float(free_std[i] / abs(free[i])) if free[i] else float("inf"),
                difference / spread if spread > 0.0 else float("inf"),
            )
        )
    return tuple(rows)
