"""Numba kernels of the other ways through the feasible set: the paper's and the closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel
from freeswing.servo.synthesis.state_space import Array
from freeswing.servo.tensions.polygon_kernels import Point

Mask = NDArray[np.bool_]


@kernel
def paper_point(N: Array, below: Array, above: Array, slack: float, repeated: bool) -> Point:
    """The paper's (29)-(31): violated bounds put to equality until all the others are met.

    "The process is repeated" is read so: bounds that a trial newly violates join the candidates.

    Args:
        N: rows of the half-planes.
        below: lower bounds of N lambda.
        above: upper bounds of N lambda.
        slack: a bound missed by less is met.
        repeated: False: only the bounds violated at the start are ever candidates.
    """
    n = N.shape[0]
    candidate = np.zeros(2 * n, dtype=np.bool_)
    _mark_violated(N, below, above, 0.0, 0.0, slack, candidate)
    nothing = Point(False, 0.0, 0.0, -1, -1, -1, np.zeros(3))
    if not candidate.any():
        return Point(True, 0.0, 0.0, -1, -1, -1, np.zeros(3))
    # Each round adds at least one of 2 n candidates, so 2 n rounds are all there can be.
    for _ in range(2 * n):
        grown = candidate.copy()
        found, u, v = _try_all(N, below, above, slack, candidate, grown)
        if found:
            return Point(True, u, v, -1, -1, -1, np.zeros(3))
        if not repeated or (grown == candidate).all():
            return nothing
        candidate = grown
    return nothing


@kernel
def _try_all(
    N: Array, below: Array, above: Array, slack: float, candidate: Mask, grown: Mask
) -> tuple[bool, float, float]:
    n = N.shape[0]
    for a in range(2 * n):
        if candidate[a]:
            usable, u, v = _on_one(N, below, above, a)
            if usable and not _mark_violated(N, below, above, u, v, slack, grown):
                return True, u, v
    for a in range(2 * n):
        for b in range(a + 1, 2 * n):
            if candidate[a] and candidate[b]:
                usable, u, v = _on_two(N, below, above, a, b)
                if usable and not _mark_violated(N, below, above, u, v, slack, grown):
                    return True, u, v
    return False, 0.0, 0.0


@kernel
def closed_form_point(
    N: Array, below: Array, above: Array, slack: float, u: float, v: float
) -> Point:
    """Pott's improved closed form (2014).

    The most violated cable is put on its bound and left out of what follows, at most r times.

    Args:
        N: rows of the half-planes.
        below: lower bounds of N lambda.
        above: upper bounds of N lambda.
        slack: a bound missed by less is met.
        u: first coordinate of the point nearest to the middle of all ranges (Pott 2009).
        v: second coordinate of it.
    """
    u0, v0 = u, v
    first = _most_violated(N, below, above, u, v, slack)
    if first >= 0:
        usable, u, v = _on_one_from(N, below, above, first, u0, v0)
        if usable:
            second = _most_violated(N, below, above, u, v, slack)
            if second >= 0:
                usable, u, v = _on_two(N, below, above, first, second)
        if not usable or _most_violated(N, below, above, u, v, slack) >= 0:
            return Point(False, u, v, first, -1, -1, np.zeros(3))
    return Point(True, u, v, -1, -1, -1, np.zeros(3))


@kernel
def _bound(below: Array, above: Array, c: int) -> float:
    return above[c // 2] if c % 2 else below[c // 2]


@kernel
def _on_one(N: Array, below: Array, above: Array, a: int) -> tuple[bool, float, float]:
    return _on_one_from(N, below, above, a, 0.0, 0.0)


@kernel
def _on_one_from(
    N: Array, below: Array, above: Array, a: int, u: float, v: float
) -> tuple[bool, float, float]:
    """The point of bound `a`'s line that is nearest to (u, v)."""
    g0, g1 = N[a // 2, 0], N[a // 2, 1]
    square = g0 * g0 + g1 * g1
    if square < 1e-18:
        return False, u, v
    step = (_bound(below, above, a) - g0 * u - g1 * v) / square
    return True, u + g0 * step, v + g1 * step


@kernel
def _on_two(N: Array, below: Array, above: Array, a: int, b: int) -> tuple[bool, float, float]:
    """Where the lines of two bounds cross."""
    a0, a1, b0, b1 = N[a // 2, 0], N[a // 2, 1], N[b // 2, 0], N[b // 2, 1]
    cross = a0 * b1 - a1 * b0
    if cross * cross <= 1e-24 * (a0 * a0 + a1 * a1) * (b0 * b0 + b1 * b1):
        return False, 0.0, 0.0
    ha, hb = _bound(below, above, a), _bound(below, above, b)
    return True, (ha * b1 - hb * a1) / cross, (a0 * hb - b0 * ha) / cross


@kernel
def _mark_violated(
    N: Array, below: Array, above: Array, u: float, v: float, slack: float, marks: Mask
) -> bool:
    """Mark every violated bound; whether there was any."""
    any_violated = False
    for i in range(N.shape[0]):
        x = N[i, 0] * u + N[i, 1] * v
        if x < below[i] - slack:
            marks[2 * i] = True
            any_violated = True
        if x > above[i] + slack:
            marks[2 * i + 1] = True
            any_violated = True
    return any_violated


@kernel
def _most_violated(N: Array, below: Array, above: Array, u: float, v: float, slack: float) -> int:
    worst, most = -1, slack
    for i in range(N.shape[0]):
        x = N[i, 0] * u + N[i, 1] * v
        if below[i] - x > most:
            worst, most = 2 * i, below[i] - x
        if x - above[i] > most:
            worst, most = 2 * i + 1, x - above[i]
    return worst
