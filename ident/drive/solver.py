"""Levenberg's and Marquardt's method on normal equations, and what it leaves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.descent import CONVERGED, Damping, LevenbergMarquardt, Stop

Array = NDArray[np.float64]

MOST_ITERATIONS = 60
DAMPING = Damping(largest=1e8)
SMALL_GAIN = 1e-8  # of the cost: at 4e4 residuals a fiftieth of a standard deviation
# Above twice their noise residuals have a cause that no number explains: there a search may end
# sooner, for it creeps along a valley whose floor says nothing.
MISFIT = 2.0
# Columns scaled to 1: below this a direction is not determined by the data in double precision.
RANK_LIMIT = 1e-13


@dataclass(frozen=True, slots=True)
class Normal:
    """A sum of squares about a point.

    Attributes:
        cost: half the sum.
        gradient: its derivative, (k,).
        matrix: J'J, (k, k).
        n: number of residuals.
    """

    cost: float
    gradient: Array
    matrix: Array
    n: int


@dataclass(frozen=True, slots=True)
class Found:
    """Where the search ended.

    Attributes:
        values: (k,).
        normal: the sum of squares there.
        iterations: steps tried.
        stopped: why, in words.
    """

    values: Array
    normal: Normal
    iterations: int
    stopped: str

    @property
    def condition(self) -> float:
        """Condition number of the Jacobian with columns of length 1."""
        return float(np.sqrt(np.linalg.cond(scaled(self.normal.matrix)[0])))


def scaled(matrix: Array) -> tuple[Array, Array]:
    """J'J of columns of length 1, and their lengths; empty columns stay empty.

    Source:
        van der Sluis 1969, Condition Numbers and Equilibration of Matrices.
    """
    lengths = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    safe = np.where(lengths > 0.0, lengths, 1.0)
    return matrix / np.outer(safe, safe), safe


def covariance_of(matrix: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Inverse of J'J, and which unknowns the data determine; the others' entries are infinite.

    Source:
        Press et al. 2007, Numerical Recipes, sec. 15.4 and 15.6.
    """
    unit, lengths = scaled(matrix)
    values, vectors = np.linalg.eigh(unit)
    kept = values > RANK_LIMIT * max(values[-1], 1.0)
    inverse = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T / np.outer(lengths, lengths)
    lost = (vectors[:, ~kept] ** 2).sum(axis=1) > 1e-6
    inverse[lost, lost] = np.inf
    return inverse, ~lost


def minimise(
    evaluate: Callable[[Array], Normal],
    start: Array,
    low: Array | None = None,
    high: Array | None = None,
    most: int = MOST_ITERATIONS,
    misfit_gain: float = SMALL_GAIN,
) -> Found:
    """The least sum of squares from a start, within bounds.

    Args:
        evaluate: the sum of squares at a point; a ValueError there is a step too far.
        start: (k,).
        low: least values, (k,).
        high: greatest values, (k,).
        most: steps tried at most.
        misfit_gain: instead of `SMALL_GAIN` where the mean square is above `MISFIT`.

    Raises:
        ValueError: when the start itself cannot be evaluated.
    """
    at = np.array(start, dtype=np.float64)
    low = np.full_like(at, -np.inf) if low is None else low
    high = np.full_like(at, np.inf) if high is None else high
    solver = LevenbergMarquardt(most, DAMPING)
    ended, count, stop = solver.descend(
        _Search(evaluate, low, high, misfit_gain), _At(at, evaluate(at))
    )
    return Found(ended.values, ended.normal, count, stop.sentence)


@dataclass(frozen=True, slots=True)
class _At:
    """A point and the sum of squares about it."""

    values: Array
    normal: Normal

    @property
    def cost(self) -> float:
        return self.normal.cost


@dataclass(frozen=True, slots=True)
class _Step:
    """A change of the values, and by what it lowers the cost to first order."""

    change: Array
    promised: float


@dataclass(frozen=True, slots=True)
class _Search:
    """A sum of squares within bounds, as `LevenbergMarquardt` takes it."""

    evaluate: Callable[[Array], Normal]
    low: Array
    high: Array
    misfit_gain: float

    def step(self, place: _At, damping: float) -> _Step:
        """Damped by Marquardt's scaling."""
        normal = place.normal
        unit, lengths = scaled(normal.matrix)
        lifted = unit + damping * np.eye(len(place.values))
        change = -np.linalg.solve(lifted, normal.gradient / lengths) / lengths
        return _Step(change, float(-normal.gradient @ change))

    def moved(self, place: _At, step: _Step) -> _At | None:
        """Led back inside the bounds; None for a step too far."""
        trial = np.clip(place.values + step.change, self.low, self.high)
        try:
            return _At(trial, self.evaluate(trial))
        except ValueError:
            return None

    def ended(
        self, place: _At, step: _Step, trial: _At | None, lower: bool, damping: float
    ) -> Stop | None:
        """Once the cost falls, or could fall, by next to nothing."""
        if trial is None:
            return None
        here = trial.cost if lower else place.cost
        gain = place.cost - trial.cost if lower else step.promised
        misfit = 2.0 * here > MISFIT * place.normal.n
        share = self.misfit_gain if misfit else SMALL_GAIN
        return CONVERGED if gain < share * max(here, 1.0) else None
