"""Improve a plan of swings by its exact gradients: sequential programming within trust regions.

In each round the swings' W^T W and limits are linear in the poses of release, the cost of their sum
is not: the subproblem keeps the eigenvalues. A swing whose step breaks a limit takes half of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.cdpr.system.progress import Progress
from freeswing.excite.choose_swings import excitation_cost, excited_directions, reduced
from freeswing.excite.swing import Bench, Swing, keeps_limits, swing_from
from freeswing.excite.swing_gradient import Differentiator, SwingSlopes

_SHARPNESS = 12.0
_SCALE = np.array([0.1, 0.1, 0.1, 0.2, 0.2, 0.2])
_FIRST_REGION = 0.25
_SMALLEST_REGION = 0.02
_MARGIN = 0.01
_HALVINGS = 3
_SETTLED = 2e-3


@dataclass(frozen=True, slots=True)
class Refined:
    """A plan after refinement.

    Attributes:
        swings: the plan.
        cost: C of eq. (40).
        history: C after each round, the first before any.
    """

    swings: tuple[Swing, ...]
    cost: float
    history: tuple[float, ...]


def refine(
    bench: Bench, swings: tuple[Swing, ...], rounds: int, progress: Progress | None = None
) -> Refined:
    """Move the releases of a plan downhill in C, within all limits.

    Args:
        bench: how swings are simulated.
        swings: a plan within the limits.
        rounds: most rounds.
        progress: told a label and a fraction.
    """
    basis = excited_directions(bench.inertia)
    differentiator, region = Differentiator(bench), _FIRST_REGION
    plan, cost = list(swings), plan_cost(bench, swings)
    history, known = [cost], [None for _ in plan]
    for done in range(rounds):
        if progress:
            progress("refining", done / rounds)
        known = [s or differentiator.slopes(w) for s, w in zip(known, plan, strict=True)]
        steps = subproblem(basis, plan, known, region)
        trial = [_moved(bench, w, step) for w, step in zip(plan, steps, strict=True)]
        trial_cost = plan_cost(bench, tuple(trial))
        if trial_cost < cost:
            known = [s if w is v else None for s, w, v in zip(known, plan, trial, strict=True)]
            gain, plan, cost = 1 - trial_cost / cost, trial, trial_cost
            region = min(1.5 * region, 1.0)
            history.append(cost)
            if gain < _SETTLED:
                break
            continue
        region *= 0.35
        if region < _SMALLEST_REGION:
            break
    return Refined(tuple(plan), cost, tuple(history))


def plan_cost(bench: Bench, swings: tuple[Swing, ...]) -> float:
    """C of a plan."""
    total = np.sum([swing.gram for swing in swings], axis=0)
    return float(excitation_cost(reduced(total, excited_directions(bench.inertia))))


def subproblem(basis: Array, plan: list[Swing], known: list[SwingSlopes], region: float) -> Array:
    """Steps of all releases, (n_e, 6), that lower C of the linearised plan the most.

    C's extreme eigenvalues are smoothed to p-norms: at the best plans several of them meet.

    Source:
        Nocedal, Wright 2006, Numerical Optimization, ch. 18: sequential programming, of
        FIDIM 2022, eqs. (41), (42).
    """
    from scipy.optimize import minimize

    total = reduced(np.sum([swing.gram for swing in plan], axis=0), basis)
    by = np.concatenate([reduced(s.gram.transpose(2, 0, 1), basis) for s in known])
    by = by * np.tile(_SCALE, len(plan))[:, None, None]
    count, width = len(plan), max(len(s.excess) for s in known)
    rows = np.zeros((count * width, 6 * count))
    bounds = np.ones(count * width)
    for k, s in enumerate(known):
        place = slice(k * width, k * width + len(s.excess))
        rows[place, 6 * k : 6 * k + 6] = s.excess_by * _SCALE
        bounds[place] = np.maximum(-s.excess - _MARGIN, 0.0)
    found = minimize(
        lambda x: smooth_cost(total, by, x),
        np.zeros(6 * count),
        jac=True,
        method="SLSQP",
        bounds=[(-region, region)] * (6 * count),
        constraints={
            "type": "ineq",
            "fun": lambda x: bounds - rows @ x,
            "jac": lambda _: -rows,
        },
        options={"maxiter": 40, "ftol": 1e-4},
    )
    steps = np.where(np.isfinite(found.x), found.x, 0.0).reshape(count, 6)
    return steps * _SCALE


def smooth_cost(total: Array, by: Array, step: Array) -> tuple[float, Array]:
    """Logarithm of C with p-norms for its extreme eigenvalues, and its gradient by the step.

    Source:
        FIDIM 2022, eq. (40), its extreme values as p-norms; derivatives of eigenvalues:
        Magnus, Neudecker 1999, Matrix Differential Calculus, ch. 8.
    """
    matrix = total + np.tensordot(step, by, axes=1)
    values, vectors = np.linalg.eigh(matrix)
    values = np.maximum(values, 1e-9 * values[-1])
    up, down = values / values[-1], values[0] / values
    heavy, light = up**_SHARPNESS, down**_SHARPNESS
    largest = values[-1] * heavy.sum() ** (1 / _SHARPNESS)
    smallest = values[0] / light.sum() ** (1 / _SHARPNESS)
    root = np.sqrt(largest)
    by_largest = largest * heavy / heavy.sum() / values
    by_smallest = smallest * light / light.sum() / values
    weights = 0.5 / (root * (root + 1)) * by_largest - 0.5 / smallest * by_smallest
    gradient_matrix = (vectors * weights) @ vectors.T
    value = np.log(root + 1) - 0.5 * np.log(smallest)
    slope = np.tensordot(by, gradient_matrix, axes=2)
    return float(value), np.asarray(slope, dtype=np.float64)


def _moved(bench: Bench, swing: Swing, step: Array) -> Swing:
    """The swing after its step, or after a half, a quarter of it; itself where none will do."""
    for halving in range(_HALVINGS):
        try:
            moved = swing_from(bench, swing.release + step / 2**halving, swing.equilibrium)
        except (ValueError, np.linalg.LinAlgError):
            continue
        if keeps_limits(bench, moved):
            return moved
    return swing
