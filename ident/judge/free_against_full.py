"""Free coordinates against full poses (FIDIM 2022, eqs. 48, 49), with z-scores."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.robot import INERTIA_NAMES, Array
from freeswing.ident.likelihood.between_runs import LEAST_RUNS


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


def between_runs(without: Array) -> Array:
    """Standard deviations of differences by leaving out one run at a time (the jackknife), (9,).

    The differences of the same runs hold what both ways have in common, and what a model's
    errors, which repeat with the swings, do to them; zero where fewer than three runs tell.

    Args:
        without: the differences without each run, (r, 9).

    Source:
        Efron 1982, The Jackknife, the Bootstrap and Other Resampling Plans, ch. 3.
    """
    count = len(without)
    if count < LEAST_RUNS or not np.isfinite(without).all():
        return np.zeros(9)
    spread = without - without.mean(axis=0)
    return np.sqrt((count - 1) / count * np.sum(spread**2, axis=0))


def compare(
    free: Array,
    free_std: Array,
    full: Array,
    full_std: Array,
    shown: NDArray[np.bool_],
    between: Array | None = None,
) -> tuple[ParameterComparison, ...]:
    """Compare nine parameters, (9,) each, where `shown`.

    The runs are the same for both, so that their errors are correlated and z is too small where
    noise dominates; where the difference varies from run to run by more (`between`, (9,)), that
    counts. A large z says that the two models disagree, whatever the noise.
    """
    apart = np.zeros(9) if between is None else between
    rows = []
    for i in np.flatnonzero(shown):
        difference = float(full[i] - free[i])
        spread = max(float(np.hypot(free_std[i], full_std[i])), float(apart[i]))
        rows.append(
            ParameterComparison(
                INERTIA_NAMES[i],
                100.0 * abs(difference / free[i]) if free[i] else float("inf"),
                100.0 * float(free_std[i] / abs(free[i])) if free[i] else float("inf"),
                difference / spread if spread > 0.0 else float("inf"),
            )
        )
    return tuple(rows)
