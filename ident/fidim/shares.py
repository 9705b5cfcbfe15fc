"""What moves FIDIM's solution beside the scatter of its equations, and by how much.

Total least squares knows the noise of single equations, alike in all columns of the regressor
(FIDIM 2022, eqs. 32, 33). Errors that many equations share move the solution and leave no scatter:
each kind is carried through to the solution here, and adds its squares to the covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.frozen import freeze
from freeswing.cdpr.robot import INERTIA_NAMES, Array
from freeswing.ident.fidim.total_least_squares import least_by_noise, values_alone

# Where the nine parameters stand in a solution, and the essential ones solved alone after them.
NINE = slice(0, len(INERTIA_NAMES))
ESSENTIAL = slice(len(INERTIA_NAMES), None)


@dataclass(frozen=True, slots=True)
class Share:
    """One kind of error and what it does to FIDIM's parameters.

    Attributes:
        name: of the kind, for people.
        key: of its size in the result file.
        changes: of the nine parameters and of the essential ones solved alone, a row an
            independent cause of one standard deviation, or the one row of a bias, (k, 9 + e).
        is_bias: whether the change is one that can be foreseen, its sign included.
    """

    name: str
    key: str
    changes: Array
    is_bias: bool = False

    def __post_init__(self) -> None:
        freeze(self, "changes")

    @property
    def covariance(self) -> Array:
        """Of all nine, (9, 9)."""
        return self.changes[:, NINE].T @ self.changes[:, NINE]

    @property
    def reduced(self) -> Array:
        """Of the essential ones solved alone, (e, e)."""
        return self.changes[:, ESSENTIAL].T @ self.changes[:, ESSENTIAL]

    def document(self) -> dict[str, Any]:
        """For the estimate's entry: the bias, or the standard deviations, of the nine."""
        sizes = self.changes[0, NINE] if self.is_bias else np.sqrt(np.diag(self.covariance))
        return {self.key: sizes.tolist()}


@dataclass(frozen=True, slots=True)
class Weighing:
    """How the covariance-weighted form counts equations.

    Attributes:
        roots: of each sample's weights, a run each: weights = root^T root, (n, e, e).
        noise: expectation of the weighted regressors' noise, squared and summed, (10, 10).
    """

    roots: tuple[Array, ...]
    noise: Array


class Stack:
    """Runs' regressors one below the other, each of which can be exchanged and all solved again.

    Args:
        regressors: a run each, (n, 6 - n_cables, 10).
        essential: which parameters the reduced problem keeps, (9,).
        weighing: of the covariance-weighted form, held as it is; None for the published one.
    """

    def __init__(
        self,
        regressors: Sequence[Array],
        essential: NDArray[np.bool_],
        weighing: Weighing | None = None,
    ) -> None:
        self.weighing = weighing
        self.rows = [self._weighed(k, one) for k, one in enumerate(regressors)]
        self.factors = [_factor(one) for one in self.rows]
        self.kept = np.append(True, essential)
        self.values = self._solved(self.factors)

    def change(self, instead: dict[int, Array]) -> Array:
        """What other regressors of some runs, by place, change the solution by, (9 + e,)."""
        moved = {k: _factor(self._weighed(k, W)) for k, W in instead.items()}
        return self._solved(list((dict(enumerate(self.factors)) | moved).values())) - self.values

    def alone(self, regressors: dict[int, Array]) -> Array:
        """What regressors of some of the runs, by place, give by themselves, (9 + e,)."""
        return self._solved([_factor(self._weighed(k, W)) for k, W in regressors.items()])

    def without_each(self, parts: Sequence[Array]) -> Array:
        """The solution without each part of the rows, (p, 9); NaN where the others do not do."""
        factors = [_factor(part) for part in parts]
        found = np.full((len(parts), 9), np.nan)
        for k in range(len(parts)):
            # What rank is lost without has the weight of all others together: no number for it.
            with suppress(ValueError, np.linalg.LinAlgError):
                found[k] = self._values(np.concatenate(factors[:k] + factors[k + 1 :]))
        return found

    def apart(self, inertia: Array) -> Array:
        """An inertia, (9,), less the solution: all nine, and the essential ones, (9 + e,)."""
        off = inertia - self.values[NINE]
        return np.concatenate([off, off[self.kept[1:]]])

    def _weighed(self, k: int, W: Array) -> Array:
        """Rows of a run's regressor as they count, (n e, 10)."""
        if self.weighing is None:
            return W.reshape(-1, W.shape[-1])
        roots = self.weighing.roots[k]
        # A swing of the same run may lack a sample at its ends.
        near = np.round(np.linspace(0, len(roots) - 1, len(W))).astype(int)
        return (roots[near] @ W).reshape(-1, W.shape[-1])

    def _solved(self, factors: list[Array]) -> Array:
        rows = np.concatenate(factors)
        return np.concatenate([self._values(rows), self._values(rows, self.kept)])

    def _values(self, rows: Array, kept: NDArray[np.bool_] | None = None) -> Array:
        chosen = np.ones(10, dtype=bool) if kept is None else kept
        if self.weighing is None:
            return values_alone(rows[:, chosen])
        return least_by_noise(rows[:, chosen], self.weighing.noise[np.ix_(chosen, chosen)])[0]


def _factor(rows: Array) -> Array:
    """Triangular factor of rows, (min(n, 10), 10)."""
    return np.asarray(np.linalg.qr(rows, mode="r"))


def shares_sentence(shares: Sequence[Share], scatter: Array) -> str:
    """Which errors move a parameter by more than the scatter, and how far; empty where none does.

    Args:
        shares: found.
        scatter: standard deviations as published (eq. 33), (9,).
    """
    said = []
    for share in shares:
        sizes = np.sqrt(np.diag(share.covariance))
        worst = int(np.argmax(sizes / scatter))
        if sizes[worst] > scatter[worst]:
            size = f"{share.changes[0, worst]:+.2g}" if share.is_bias else f"{sizes[worst]:.2g}"
            times = sizes[worst] / scatter[worst]
            said.append(f"{share.name}: {INERTIA_NAMES[worst]} by {size}, {times:.1f} times it")
    if not said:
        return ""
    return (
        "standard deviations hold what moves the solution by more than the samples' scatter (FIDIM "
        f"2022, eq. 33) tells: {'; '.join(said)}"
    )
