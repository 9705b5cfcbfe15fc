"""FIDIM: inertial parameters from the internal dynamics along free motions (FIDIM 2022, sec. 3).

The regressors of all runs stacked, total least squares, essential parameters by the 10 % rule and
the reduced problem solved again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.robot import INERTIA_NAMES, Array
from freeswing.ident.fidim.essential_parameters import (
    WELL_IDENTIFIED_PERCENT,
    essential_parameters,
)
from freeswing.ident.fidim.total_least_squares import (
    LEAST_GAP,
    TotalLeastSquares,
    total_least_squares,
)

GOOD_COST = 100.0  # FIDIM 2022, after eq. (42)
OPTIMAL_COST = 10.0  # told beside the above; no verdict depends on it


@dataclass(frozen=True, slots=True)
class FidimEstimate:
    """What FIDIM makes of a set of runs.

    Attributes:
        solution: all nine parameters, in the order of `INERTIA_NAMES`.
        essential: which of them are, (9,).
        reduced: the problem solved again with the essential parameters alone.
        n_samples: samples in the stack (each gives 6 - n equations).
        verdicts: what is wrong or worth knowing, in words; empty when nothing is.
        without_run: all nine parameters without each run, (r, 9); NaN where the others do not do.
    """

    solution: TotalLeastSquares
    essential: NDArray[np.bool_]
    reduced: TotalLeastSquares
    n_samples: int
    verdicts: tuple[str, ...]
    without_run: Array

    @property
    def values(self) -> Array:
        """The nine parameters, (9,)."""
        return self.solution.values

    @property
    def std(self) -> Array:
        """Their standard deviations as published (eq. 33), (9,)."""
        return self.solution.std


def fidim(regressors: list[Array]) -> FidimEstimate:
    """Identify from the regressors W'_EE of one or more runs.

    Args:
        regressors: one array a run, (n_samples, 6 - n, 10).

    Raises:
        ValueError: when there are too few samples, or rank is lost: with the blind direction.
    """
    n_samples = sum(len(regressor) for regressor in regressors)
    W = np.concatenate([regressor.reshape(-1, 10) for regressor in regressors])
    solution = total_least_squares(W)
    if solution.loses_rank:
        raise ValueError(rank_loss_sentence(solution))
    essential = essential_parameters(W)
    reduced = total_least_squares(W[:, np.concatenate([[True], essential])])
    verdicts = tuple(_verdicts(solution, essential))
    without = _without_each([regressor.reshape(-1, 10) for regressor in regressors])
    return FidimEstimate(solution, essential, reduced, n_samples, verdicts, without)


def _without_each(runs: list[Array]) -> Array:
    """The solution without each run, (r, 9): of the runs' triangular factors, which do as well."""
    factors = [np.linalg.qr(run, mode="r") for run in runs]
    found = np.full((len(runs), 9), np.nan)
    for k in range(len(runs)):
        others = factors[:k] + factors[k + 1 :]
        rows = np.concatenate(others) if others else np.zeros((0, 10))
        try:
            one = total_least_squares(rows)
        except ValueError:
            continue
        found[k] = np.nan if one.loses_rank else one.values
    return found


def rank_loss_sentence(solution: TotalLeastSquares) -> str:
    """Which parameters the swings leave undetermined, and what to record."""
    weights = np.abs(solution.blind)
    names = [INERTIA_NAMES[i] for i in np.argsort(-weights) if weights[i] > 0.3 * weights.max()]
    return (
        "the swings do not determine the nine inertial parameters: the regressor's ninth singular "
        f"value is {solution.singular_values[-2]:.3g}, {solution.gap:.2g} times the tenth (at "
        f"least {LEAST_GAP:g} is needed), blind along {', '.join(names)}; record larger swings in "
        "all modes about more equilibria, and see that each is a free swing of this robot"
    )


def _verdicts(solution: TotalLeastSquares, essential: NDArray[np.bool_]) -> list[str]:
    """Sentences about excitation and about parameters that came out badly."""
    said = []
    if solution.cost_C > GOOD_COST:
        said.append(
            f"poor excitation: C = {solution.cost_C:.3g}, below {GOOD_COST:g} is good and below "
            f"{OPTIMAL_COST:g} optimal; record larger swings about more equilibria"
        )
    percent = solution.std_percent
    bad = essential & (percent > WELL_IDENTIFIED_PERCENT)
    if bad.any():
        named = ", ".join(
            f"{name} ({value:.0f} %)"
            for name, value, is_bad in zip(INERTIA_NAMES, percent, bad, strict=True)
            if is_bad
        )
        said.append(
            f"not near zero and yet uncertain by more than {WELL_IDENTIFIED_PERCENT:g} %: {named}"
        )
    return said
