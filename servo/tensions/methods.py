"""One verb for all ways of distributing wrenches over cables, and what it answers in words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.frozen import freeze
from freeswing.servo.synthesis.state_space import Array
from freeswing.servo.tensions.least_distance import distribute_qp
from freeswing.servo.tensions.loop_kernels import (
    BARYCENTRE,
    CLOSED_FORM,
    FEASIBLE,
    IMPOSSIBLE,
    NEAREST,
    NOT_FOUND,
    PAPER,
    SCALED,
    SINGULAR,
    distribute_rows,
)

KERNELS = {
    "nearest": NEAREST,
    "barycentre": BARYCENTRE,
    "paper": PAPER,
    "closed-form": CLOSED_FORM,
}
METHODS = (*KERNELS, "qp")
# The kernels know polygons: two spare cables and no more.
MOST_SPARE = 2
WORDS = {
    FEASIBLE: "feasible",
    SCALED: "scaled",
    IMPOSSIBLE: "impossible",
    SINGULAR: "singular",
    NOT_FOUND: "not-found",
}


@dataclass(frozen=True, slots=True)
class Demands:
    """Wrenches that are wanted, one a row: x with A x = b - offset between lower and upper.

    Attributes:
        A: (k, 6, n); b: (k, 6), what is scaled where it is too much.
        offset: (k, 6), what acts besides.
        lower: (k, n).
        upper: (k, n).
        wish: (k, n), where x should be near.
    """

    A: Array
    b: Array
    offset: Array
    lower: Array
    upper: Array
    wish: Array

    def __post_init__(self) -> None:
        freeze(self, "A", "b", "offset", "lower", "upper", "wish")
        rows, six, n = self.A.shape
        shapes = [getattr(self, key).shape for key in ("b", "offset", "lower", "upper", "wish")]
        if six != 6 or shapes != [(rows, 6), (rows, 6), *[(rows, n)] * 3]:
            raise ValueError(f"A of shape {self.A.shape} and {shapes} do not fit together")
        if n < 6:
            raise ValueError(
                f"{n} cables: with fewer than 6 (r = {n - 6} < 0) no tensions give every wrench"
            )


@dataclass(frozen=True, slots=True)
class Shares:
    """The answers, one a row.

    Attributes:
        x: (k, n), NaN where there is none.
        status: one of `WORDS` a row. "scaled": x is for `scale` times the wrench, the largest
            share that is feasible; "not-found": feasible, but this method does not get there.
        scale: (k,), 1 where feasible, NaN where no share is.
        stops: the cable that stops a larger scale and "low" or "high", None where nothing does.
    """

    x: Array
    status: tuple[str, ...]
    scale: Array
    stops: tuple[tuple[int, str] | None, ...]


def distribute_all(demands: Demands, method: str = "nearest") -> Shares:
    """Distribute each wrench by itself.

    Args:
        demands: the wrenches and bounds.
        method: one of `METHODS`; "nearest" and "qp" agree, the second takes any n.

    Raises:
        ValueError: for an unknown method, or one that does not take so many cables.
    """
    if method not in METHODS:
        raise ValueError(f"method {method!r}: one of {', '.join(METHODS)}")
    n = demands.A.shape[2]
    if n > 6 + MOST_SPARE and method not in ("nearest", "qp"):
        raise ValueError(f"method {method} takes 6 to 8 cables, not {n}: take qp")
    numbers = [getattr(demands, key) for key in ("A", "b", "offset", "lower", "upper", "wish")]
    if method == "qp" or n > 6 + MOST_SPARE:
        rows = [distribute_qp(*row) for row in zip(*numbers, strict=True)]
        x = np.array([row.x for row in rows]).reshape(len(rows), n)
        status, scale = [row.status for row in rows], np.array([row.scale for row in rows])
        stops = [row.stops for row in rows]
    else:
        A, b, offset, lower, upper, wish = (np.array(array, order="C") for array in numbers)
        x, status, scale, stops = distribute_rows(A, b, offset, lower, upper, wish, KERNELS[method])
    named = tuple(None if c < 0 else (int(c) // 2, "high" if c % 2 else "low") for c in stops)
    return Shares(x, tuple(WORDS[int(s)] for s in status), scale, named)
