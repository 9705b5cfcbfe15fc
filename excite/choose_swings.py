"""Which swings to record together: the cost C of eq. (40) and the choice out of a library.

Along exact free motions W chi = 0 for the nominal parameters chi, whatever the swing: on the nine
directions left, the stacked W^T W is the sum of the swings' own, so that a plan is scored by one
small eigenvalue problem and swings are exchanged one by one until nothing improves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.robot import Array

_GAIN = 1e-9

Cost = Callable[[Array], Array]


@dataclass(frozen=True, slots=True)
class Choice:
    """Swings chosen out of a library.

    Attributes:
        indices: of the swings, (n_e,), rising.
        cost: of the plan; smaller is better.
    """

    indices: tuple[int, ...]
    cost: float


def excited_directions(inertia: Array) -> Array:
    """Orthonormal basis of the nine directions that W can excite, (10, 9): all but chi's.

    Source:
        FIDIM 2022, sec. 3.2: W chi = 0; the complement by Golub, Van Loan 2013, Matrix
        Computations, sec. 2.4.
    """
    chi = np.concatenate([[1.0], inertia])
    full = np.linalg.svd(chi[None, :])[2]
    return full[1:].T


def reduced(grams: Array, basis: Array) -> Array:
    """W^T W (..., 10, 10) on the excited directions, (..., 9, 9).

    Source:
        FIDIM 2022, eq. (40): s9 is the least singular value that is not zero.
    """
    return basis.T @ grams @ basis


def excitation_cost(grams: Array) -> Array:
    """C = (s_1 + 1) / s_9 of eq. (40), from reduced W^T W (..., 9, 9)."""
    squares = np.linalg.eigvalsh(grams)
    largest, smallest = np.maximum(squares[..., -1], 0), np.maximum(squares[..., 0], 1e-300)
    return (np.sqrt(largest) + 1) / np.sqrt(smallest)


def stacked_cost(stacked: Array) -> float:
    """C of W itself, (rows, 10), as the paper has it: W stripped of its smallest singular value."""
    singular = np.linalg.svd(stacked, compute_uv=False)
    return float((singular[0] + 1) / singular[8])


def determinant_cost(information: Array) -> Array:
    """Minus half the log determinant of information matrices (..., k, k): D-optimality.

    Source:
        Boyd, Vandenberghe 2004, Convex Optimization, sec. 7.5.
    """
    sign, value = np.linalg.slogdet(information)
    return np.where(sign > 0, -0.5 * value, np.inf).astype(np.float64)


def choose(
    matrices: Array, n_swings: int, rng: np.random.Generator, cost: Cost = excitation_cost
) -> Choice:
    """One start: a random plan, improved by exchanging swings until no exchange helps.

    Args:
        matrices: one a swing, (m, k, k), whose sum scores a plan.
        n_swings: swings a plan.
        rng: source of the random plan.
        cost: scores sums (..., k, k).

    Raises:
        ValueError: when the library is smaller than the plan.
    """
    if len(matrices) < n_swings:
        raise ValueError(f"a library of {len(matrices)} swings cannot give a plan of {n_swings}")
    plan = list(rng.choice(len(matrices), n_swings, replace=False))
    best = float(cost(matrices[plan].sum(axis=0)))
    improved = True
    while improved:
        improved = False
        for place in range(n_swings):
            rest = matrices[plan].sum(axis=0) - matrices[plan[place]]
            scores = cost(rest + matrices)
            scores[plan] = np.inf
            found = int(np.argmin(scores))
            if scores[found] < best * (1 - _GAIN) if best > 0 else scores[found] < best - _GAIN:
                plan[place], best, improved = found, float(scores[found]), True
    return Choice(tuple(sorted(int(k) for k in plan)), best)


def random_costs(matrices: Array, n_swings: int, n_plans: int, rng: np.random.Generator) -> Array:
    """C of plans drawn at random from the library, (n_plans,)."""
    plans = [rng.choice(len(matrices), n_swings, replace=False) for _ in range(n_plans)]
    sums = np.array([matrices[plan].sum(axis=0) for plan in plans])
    return excitation_cost(sums.reshape(n_plans, *matrices.shape[1:]))
