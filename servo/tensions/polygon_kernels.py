"""Numba kernels of the feasible set in the null space of the wrench matrix, for r <= 2.

All currents that give one wrench are x0 + N lambda, N orthonormal (n, r). Each bound is a
half-plane of lambda. For r < 2 the missing columns of N are zero: every half-plane is then a
strip's edge or nothing at all, and the same code serves.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from freeswing.cdpr.compiled.kernels import kernel
from freeswing.servo.synthesis.state_space import Array

# Shares of the widest range between two bounds. A bound missed by less than HIT is met: the sum
# of eight rounding errors is a thousand times smaller, a sensor's step a thousand times larger.
HIT = 1e-11
# A cable whose row of N is shorter than this cannot be changed without changing the wrench.
BLIND = 1e-9


class Basis(NamedTuple):
    """Of a wrench matrix A (6, n): A' = Q1 R, and the null space padded to two columns."""

    Q1: Array
    R: Array
    N: Array
    rank_ratio: float


@kernel
def basis_of(A: Array) -> Basis:
    """Householder QR of A'; `rank_ratio` is the smallest over the largest diagonal of R."""
    m, n = A.shape
    R = A.T.copy()
    Q = np.eye(n)
    v = np.empty(n)
    for k in range(m):
        size = 0.0
        for i in range(k, n):
            size += R[i, k] * R[i, k]
        size = np.sqrt(size)
        if size == 0.0:
            continue
        if R[k, k] > 0.0:
            size = -size
        for i in range(k, n):
            v[i] = R[i, k]
        v[k] -= size
        beta = -1.0 / (size * v[k])
        for j in range(k, m):
            dot = 0.0
            for i in range(k, n):
                dot += v[i] * R[i, j]
            dot *= beta
            for i in range(k, n):
                R[i, j] -= dot * v[i]
        for j in range(n):
            dot = 0.0
            for i in range(k, n):
                dot += Q[j, i] * v[i]
            dot *= beta
            for i in range(k, n):
                Q[j, i] -= dot * v[i]
    N = np.zeros((n, 2))
    for i in range(n):
        for j in range(m, min(n, m + 2)):
            N[i, j - m] = Q[i, j]
    largest, smallest = 0.0, np.inf
    for k in range(m):
        largest = max(largest, abs(R[k, k]))
        smallest = min(smallest, abs(R[k, k]))
    ratio = smallest / largest if largest > 0.0 else 0.0
    return Basis(Q[:, :m].copy(), R[:m, :m].copy(), N, ratio)


@kernel
def least_norm(basis: Basis, b: Array) -> Array:
    """The shortest x with A x = b (the paper's eq. (27)): Q1 R'^-1 b."""
    m = b.shape[0]
    y = np.empty(m)
    for i in range(m):
        total = b[i]
        for j in range(i):
            total -= basis.R[j, i] * y[j]
        y[i] = total / basis.R[i, i]
    n = basis.Q1.shape[0]
    x = np.zeros(n)
    for i in range(n):
        for j in range(m):
            x[i] += basis.Q1[i, j] * y[j]
    return x


@kernel
def in_null_space(N: Array, wish: Array) -> Array:
    """N N' wish (the paper's eq. (28))."""
    a = 0.0
    b = 0.0
    for i in range(N.shape[0]):
        a += N[i, 0] * wish[i]
        b += N[i, 1] * wish[i]
    x = np.empty(N.shape[0])
    for i in range(N.shape[0]):
        x[i] = N[i, 0] * a + N[i, 1] * b
    return x


class Point(NamedTuple):
    """A point of the polygon, or why there is none.

    Where there is none, the bounds `first, second, third` (-1: not used) contradict each other
    with the weights `y`. Bound 2 i is cable i's lower one, 2 i + 1 its upper one.
    """

    found: bool
    u: float
    v: float
    first: int
    second: int
    third: int
    y: Array


@kernel
def nearest_point(N: Array, below: Array, above: Array, slack: float) -> Point:
    """The point of `below <= N lambda <= above` that is nearest to the origin.

    Bounds come in one by one; where one is violated the new nearest point lies on its line, and
    the bounds before it leave an interval there (Seidel's method for two unknowns).

    Args:
        N: rows of the half-planes.
        below: lower bounds of N lambda.
        above: upper bounds of N lambda.
        slack: a bound missed by less is met.
    """
    n = N.shape[0]
    none = np.zeros(3)
    u = v = 0.0
    for c in range(2 * n):
        g0, g1, h = _half_plane(N, below, above, c)
        if g0 * u + g1 * v <= h + slack:
            continue
        square = g0 * g0 + g1 * g1
        if square < BLIND * BLIND:
            none[0] = 1.0
            return Point(False, u, v, c, -1, -1, none)
        pu, pv = g0 * h / square, g1 * h / square
        low, high, at_low, at_high = -np.inf, np.inf, -1, -1
        for k in range(c):
            a0, a1, b = _half_plane(N, below, above, k)
            along = a1 * g0 - a0 * g1
            room = b - a0 * pu - a1 * pv
            if along * along <= 1e-24 * square * (a0 * a0 + a1 * a1):
                # Opposite bounds of one cable, or of two that act alike.
                if room < -slack and a0 * g0 + a1 * g1 < 0.0:
                    none[0] = np.sqrt(a0 * a0 + a1 * a1)
                    none[1] = np.sqrt(square)
                    return Point(False, u, v, c, k, -1, none)
                continue
            t = room / along
            if along > 0.0 and t < high:
                high, at_high = t, k
            elif along < 0.0 and t > low:
                low, at_low = t, k
        if low > high:
            if (low - high) * square > slack:
                y = _contradiction(N, below, above, c, at_low, at_high)
                return Point(False, u, v, c, at_low, at_high, y)
            low = high = 0.5 * (low + high)
        t = min(max(0.0, low), high)
        u, v = pu - t * g1, pv + t * g0
    return Point(True, u, v, -1, -1, -1, none)


@kernel
def _half_plane(N: Array, below: Array, above: Array, c: int) -> tuple[float, float, float]:
    i = c // 2
    if c % 2:
        return N[i, 0], N[i, 1], above[i]
    return -N[i, 0], -N[i, 1], -below[i]


@kernel
def _contradiction(
    N: Array, below: Array, above: Array, first: int, second: int, third: int
) -> Array:
    """Weights y >= 0 with y1 g1 + y2 g2 + y3 g3 = 0."""
    a0, a1, _ = _half_plane(N, below, above, first)
    b0, b1, _ = _half_plane(N, below, above, second)
    c0, c1, _ = _half_plane(N, below, above, third)
    y = np.array([b0 * c1 - b1 * c0, c0 * a1 - c1 * a0, a0 * b1 - a1 * b0])
    return np.abs(y)


@kernel
def barycentre(N: Array, below: Array, above: Array, box: float) -> Point:
    """Centre of area of the polygon; of a segment or a point that has none, the mean corner.

    Args:
        N: rows of the half-planes.
        below: lower bounds of N lambda.
        above: upper bounds of N lambda.
        box: half the side of a square that holds the polygon.
    """
    n = N.shape[0]
    xs, ys = np.empty(2 * n + 8), np.empty(2 * n + 8)
    new_xs, new_ys = np.empty(2 * n + 8), np.empty(2 * n + 8)
    xs[0], ys[0], xs[1], ys[1] = -box, -box, box, -box
    xs[2], ys[2], xs[3], ys[3] = box, box, -box, box
    count = 4
    for c in range(2 * n):
        g0, g1, h = _half_plane(N, below, above, c)
        count = _clip(xs, ys, count, g0, g1, h, new_xs, new_ys)
        if count == 0:
            return Point(False, 0.0, 0.0, c, -1, -1, np.zeros(3))
        for k in range(count):
            xs[k], ys[k] = new_xs[k], new_ys[k]
    return _centre(xs, ys, count, box)


@kernel
def _clip(
    xs: Array, ys: Array, count: int, g0: float, g1: float, h: float, new_xs: Array, new_ys: Array
) -> int:
    """Cut a convex polygon by g . p <= h (Sutherland and Hodgman); the number of corners left."""
    made = 0
    for k in range(count):
        j = k + 1 if k + 1 < count else 0
        here = g0 * xs[k] + g1 * ys[k] - h
        there = g0 * xs[j] + g1 * ys[j] - h
        if here <= 0.0:
            new_xs[made], new_ys[made] = xs[k], ys[k]
            made += 1
        if (here < 0.0 < there) or (there < 0.0 < here):
            share = here / (here - there)
            new_xs[made] = xs[k] + share * (xs[j] - xs[k])
            new_ys[made] = ys[k] + share * (ys[j] - ys[k])
            made += 1
    return made


@kernel
def _centre(xs: Array, ys: Array, count: int, box: float) -> Point:
    mean_x = mean_y = 0.0
    for k in range(count):
        mean_x += xs[k] / count
        mean_y += ys[k] / count
    area = centre_x = centre_y = 0.0
    for k in range(count):
        j = k + 1 if k + 1 < count else 0
        ax, ay = xs[k] - mean_x, ys[k] - mean_y
        bx, by = xs[j] - mean_x, ys[j] - mean_y
        cross = ax * by - bx * ay
        area += cross
        centre_x += (ax + bx) * cross
        centre_y += (ay + by) * cross
    # A sliver this thin has its centre of area drowned in rounding.
    if area > 1e-12 * box * box:
        mean_x += centre_x / (3.0 * area)
        mean_y += centre_y / (3.0 * area)
    return Point(True, mean_x, mean_y, -1, -1, -1, np.zeros(3))
