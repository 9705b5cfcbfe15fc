"""The numba kernel that a control loop calls: one wrench in, currents and how it went out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel
from freeswing.servo.synthesis.state_space import Array
from freeswing.servo.tensions.method_kernels import closed_form_point, paper_point
from freeswing.servo.tensions.polygon_kernels import (
    HIT,
    Basis,
    Point,
    barycentre,
    basis_of,
    in_null_space,
    least_norm,
    nearest_point,
)

NEAREST, BARYCENTRE, PAPER, CLOSED_FORM = 0, 1, 2, 3
FEASIBLE, SCALED, IMPOSSIBLE, SINGULAR, NOT_FOUND = 0, 1, 2, 3, 4
# Rows of the wrench matrix that depend on each other to this share give wrenches that no
# tensions can make: below it the currents of a newton reach 1e8 A.
RANK = 1e-9


class Currents(NamedTuple):
    """One wrench's answer.

    `stops` is the bound that a larger scale would break first (cable i's lower 2 i, upper
    2 i + 1), -1 where the wrench is feasible; `scale` is 1 then.
    """

    x: Array
    status: int
    scale: float
    stops: int


@kernel
def distribute(
    A: Array, b: Array, offset: Array, lower: Array, upper: Array, wish: Array, method: int
) -> Currents:
    """X with A x = b - offset, lower <= x <= upper; else with the largest share of b.

    Args:
        A: (6, n), what each unknown does to the platform, n = 6 to 8.
        b: (6,), the wrench that is wanted.
        offset: (6,), what acts besides A x and is not scaled.
        lower: (n,) bounds.
        upper: (n,) bounds.
        wish: (n,), where x should be near (NEAREST, PAPER).
        method: NEAREST, BARYCENTRE, PAPER or CLOSED_FORM.
    """
    n = A.shape[1]
    basis = basis_of(A)
    if basis.rank_ratio < RANK:
        return Currents(np.full(n, np.nan), SINGULAR, np.nan, -1)
    widest = 0.0
    for i in range(n):
        widest = max(widest, upper[i] - lower[i])
        if upper[i] < lower[i]:
            return Currents(np.full(n, np.nan), IMPOSSIBLE, np.nan, 2 * i)
    slack = HIT * widest
    x_b = least_norm(basis, b)
    x_rest = in_null_space(basis.N, wish) - least_norm(basis, offset)
    x0 = x_b + x_rest
    nearest = nearest_point(basis.N, lower - x0, upper - x0, slack)
    if not nearest.found:
        return _scaled(basis.N, x_rest, x_b, lower, upper, slack)
    point = nearest
    if method != NEAREST:
        point = _by(method, basis, x0, lower, upper, wish, slack)
        if not point.found:
            return Currents(np.full(n, np.nan), NOT_FOUND, np.nan, -1)
    return Currents(_at(basis.N, x0, point), FEASIBLE, 1.0, -1)


@kernel
def distribute_rows(
    A: Array, b: Array, offset: Array, lower: Array, upper: Array, wish: Array, method: int
) -> tuple[Array, NDArray[np.int64], Array, NDArray[np.int64]]:
    """`distribute` for arrays with one row a wrench: x, status, scale, stops."""
    rows, n = A.shape[0], A.shape[2]
    x, scale = np.empty((rows, n)), np.empty(rows)
    status, stops = np.empty(rows, np.int64), np.empty(rows, np.int64)
    for k in range(rows):
        one = distribute(A[k], b[k], offset[k], lower[k], upper[k], wish[k], method)
        x[k], status[k], scale[k], stops[k] = one.x, one.status, one.scale, one.stops
    return x, status, scale, stops


@kernel
def _by(
    method: int, basis: Basis, x0: Array, lower: Array, upper: Array, wish: Array, slack: float
) -> Point:
    below, above = lower - x0, upper - x0
    if method == PAPER:
        return paper_point(basis.N, below, above, slack, True)
    if method == CLOSED_FORM:
        u = v = 0.0
        for i in range(len(x0)):
            from_wish = 0.5 * (lower[i] + upper[i]) - wish[i]
            u += basis.N[i, 0] * from_wish
            v += basis.N[i, 1] * from_wish
        return closed_form_point(basis.N, below, above, slack, u, v)
    box = 0.0
    for i in range(len(x0)):
        box += max(abs(below[i]), abs(above[i]))
    centre = barycentre(basis.N, below, above, box)
    # A polygon that is a single point to rounding is cut away; the nearest point is that point.
    return centre if centre.found else nearest_point(basis.N, below, above, slack)


@kernel
def _scaled(
    N: Array, x_rest: Array, x_b: Array, lower: Array, upper: Array, slack: float
) -> Currents:
    """The largest scale in [0, 1].

    Each contradiction, three bounds that leave no point, is linear in the scale and says how far
    it must come down; the next one is looked for there.
    """
    n = len(x_b)
    scale, stops = 1.0, -1
    # Each step leaves one of the contradictions of 3 in 2 n bounds for good; four are the rule.
    for _ in range(2 * n * n):
        x0 = x_rest + scale * x_b
        point = nearest_point(N, lower - x0, upper - x0, slack)
        if point.found:
            return Currents(_at(N, x0, point), SCALED, scale, stops)
        bounds = (point.first, point.second, point.third)
        value = slope = strongest = 0.0
        for j in range(3):
            c = bounds[j]
            if c < 0:
                continue
            i = c // 2
            room = upper[i] - x_rest[i] if c % 2 else x_rest[i] - lower[i]
            rate = -x_b[i] if c % 2 else x_b[i]
            value += point.y[j] * room
            slope += point.y[j] * rate
            if point.y[j] * -rate > strongest:
                strongest, stops = point.y[j] * -rate, c
        lower_scale = -value / slope if slope < 0.0 else -1.0
        if lower_scale < 0.0:
            return Currents(np.full(n, np.nan), IMPOSSIBLE, np.nan, stops)
        # A step lost in rounding must not keep the loop where it is.
        scale = min(lower_scale, scale * (1.0 - 1e-14) - 1e-300)
    return Currents(np.full(n, np.nan), IMPOSSIBLE, np.nan, stops)


@kernel
def _at(N: Array, x0: Array, point: Point) -> Array:
    x = np.empty(len(x0))
    for i in range(len(x0)):
        x[i] = x0[i] + N[i, 0] * point.u + N[i, 1] * point.v
    return x
