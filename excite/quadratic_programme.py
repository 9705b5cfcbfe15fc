"""A small quadratic programme with many bounds of which few matter: they are taken up as broken."""

from __future__ import annotations

import casadi as ca
import numpy as np

from freeswing.cdpr.robot import Array

_SLACK_PRICE = 1e3
_MOST_CUTS = 12
_CUTS = 6
_ALLOWED_EXCESS = 1e-4


def least_effort(
    effort: Array, equal: Array, target: Array, rows: Array, low: Array, high: Array
) -> Array:
    """Minimiser of x' effort x with equal x = target and low <= rows x <= high, the last softly.

    Rows are taken up as they are broken; one slack, heavily priced, keeps the problem solvable
    where the limits cannot be met.

    Source:
        Nocedal, Wright 2006, Numerical Optimization, ch. 16: active sets.
    """
    scale = np.maximum(high - low, 1e-9)
    held: list[int] = []
    step = _quadratic(effort, equal, target, rows[held], low[held], high[held])
    for _ in range(_MOST_CUTS):
        moved = rows @ step
        excess = np.maximum(low - moved, moved - high) / scale
        worst = [int(k) for k in np.argsort(-excess)[:_CUTS] if excess[k] > _ALLOWED_EXCESS]
        fresh = [k for k in worst if k not in held]
        if not fresh:
            break
        held += fresh
        step = _quadratic(effort, equal, target, rows[held], low[held], high[held])
    return step


def _quadratic(
    effort: Array, equal: Array, target: Array, rows: Array, low: Array, high: Array
) -> Array:
    """As `least_effort`, all rows at once, by an active-set method."""
    size, scale = len(effort), np.trace(effort) / len(effort)
    hessian = np.zeros((size + 1, size + 1))
    hessian[:size, :size] = effort / scale
    hessian[size, size] = 1e-6
    slope = np.zeros(size + 1)
    slope[size] = _SLACK_PRICE
    ones, none = np.ones((len(rows), 1)), np.zeros((len(equal), 1))
    matrix = np.vstack(
        [np.hstack([equal, none]), np.hstack([rows, ones]), np.hstack([rows, -ones])]
    )
    unbound = np.full(len(rows), np.inf)
    lower = np.concatenate([target, low, -unbound])
    upper = np.concatenate([target, unbound, high])
    options = {"print_iter": False, "print_header": False, "print_info": False}
    shapes = {"h": ca.Sparsity.dense(size + 1, size + 1), "a": ca.Sparsity.dense(*matrix.shape)}
    solver = ca.conic("release", "qrqp", shapes, {**options, "error_on_fail": False})
    floor = np.append(np.full(size, -np.inf), 0.0)
    found = solver(h=hessian, g=slope, a=matrix, lba=lower, uba=upper, lbx=floor)
    return np.array(found["x"]).ravel()[:size]
