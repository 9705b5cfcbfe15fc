"""Any number of spare cables: the nearest feasible point by non-negative least squares.

Lawson and Hanson 1974, chapter 23 (least distance programming); the largest feasible scale by a
linear programme (HiGHS). Slower than the polygon, and independent of it.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
from scipy.optimize import linprog, nnls

from freeswing.servo.synthesis.state_space import Array
from freeswing.servo.tensions.loop_kernels import (
    FEASIBLE,
    IMPOSSIBLE,
    RANK,
    SCALED,
    SINGULAR,
    Currents,
)

# Residual of the non-negative problem, whose right side is 1: zero means no point is feasible.
# A set that is feasible by 1e-6 of the widest range leaves 1e-6.
EMPTY = 1e-9
# Shares of the widest range: a cable so close to its bound is what stops the scale.
ON_BOUND = 1e-9


def distribute_qp(
    A: Array, b: Array, offset: Array, lower: Array, upper: Array, wish: Array
) -> Currents:
    """As `loop_kernels.distribute` with NEAREST, for any n >= 6."""
    n = A.shape[1]
    nothing = np.full(n, np.nan)
    size = np.linalg.svd(A, compute_uv=False)
    if size[-1] < RANK * size[0]:
        return Currents(nothing, SINGULAR, np.nan, -1)
    if (upper < lower).any():
        return Currents(nothing, IMPOSSIBLE, np.nan, 2 * int(np.argmin(upper - lower)))
    x = _nearest(A, b - offset, lower, upper, wish)
    if x is not None:
        return Currents(x, FEASIBLE, 1.0, -1)
    return _scaled(A, b, offset, lower, upper)


def _nearest(A: Array, b: Array, lower: Array, upper: Array, wish: Array) -> Array | None:
    N = scipy.linalg.null_space(A)
    x0 = wish + np.linalg.pinv(A) @ (b - A @ wish)
    wide = max(float((upper - lower).max()), np.finfo(float).tiny)
    h = np.concatenate([lower - x0, x0 - upper]) / wide
    if N.shape[1] == 0:
        return x0 if h.max() <= ON_BOUND else None
    if h.max() <= 0.0:
        return x0
    goal = np.zeros(N.shape[1] + 1)
    goal[-1] = 1.0
    rows = np.vstack([np.vstack([N, -N]).T, h[None, :]])
    weights, left = nnls(rows, goal)
    if left < EMPTY:
        return None
    rest = rows @ weights - goal
    return x0 + N @ (-rest[:-1] / rest[-1]) * wide


def _scaled(A: Array, b: Array, offset: Array, lower: Array, upper: Array) -> Currents:
    n = A.shape[1]
    cost = np.zeros(n + 1)
    cost[-1] = -1.0
    found = linprog(
        cost,
        A_eq=np.column_stack([A, -b]),
        b_eq=-offset,
        bounds=[*zip(lower, upper, strict=True), (0.0, 1.0)],
        method="highs",
    )
    if found.x is None:
        return Currents(np.full(n, np.nan), IMPOSSIBLE, np.nan, -1)
    x = found.x[:-1]
    # The multiplier of a bound: how much the scale would gain if it gave way.
    gain = np.column_stack([found.lower.marginals[:-1], -found.upper.marginals[:-1]]).ravel()
    return Currents(x, SCALED, float(found.x[-1]), int(np.argmax(gain)))
