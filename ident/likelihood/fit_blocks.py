"""The fit of runs that tell their slopes by block: Levenberg-Marquardt over all of them.

Unknowns that each run has for itself are eliminated run by run through QR; what is left goes into
one small triangle (Bjoerck, Numerical Methods for Least Squares Problems, 1996, sec. 6.3).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from freeswing.cdpr.descent import LevenbergMarquardt, Stop, Undamped, converged
from freeswing.cdpr.robot import Array
from freeswing.ident.likelihood.fit import RANK_LIMIT, Solution, shared_covariance
from freeswing.ident.likelihood.unknowns import Unknown, Unknowns

FIRST_DAMPING = 1e-4  # of a column's own curvature, where a full step has failed
LARGEST_DAMPING = 1e8  # from here on a step is too small to lower anything
ROUNDING = 1e-12  # share of the cost by which a step may raise it and still stand


Part = tuple[Array, Array, Array]  # residuals, slopes by own unknowns, slopes by shared ones


class Swing(Protocol):
    """A run as the fit sees it."""

    @property
    def name(self) -> str:
        """Of the run, for messages."""
        ...

    def simulated(self, values: Mapping[str, Array]) -> Any:
        """What is costly at the values of the blocks, once; ValueError: no motion there."""

    def residuals(self, values: Mapping[str, Array], made: Any, /) -> Array:
        """Whitened residuals (m,) at values, of which `made` was simulated."""
        ...

    def linearised(
        self, values: Mapping[str, Array], made: Any, /
    ) -> tuple[Array, dict[str, Array]]:
        """The same with their slopes (m, size) by block; a block left out has none."""
        ...


@dataclass(frozen=True, slots=True)
class Dense:
    """How to fit runs whose rows are told by block.

    Attributes:
        steps: at most so many.
        tolerance: converged when a full step lowers the cost by less (a cost of 1 is one standard
            deviation of one number).
        farthest: longest step, in scales of the unknowns.
    """

    steps: int = 40
    tolerance: float = 1e-3
    farthest: float = 5.0

    def fitted(self, swings: Sequence[Swing], unknowns: Unknowns) -> Solution:
        """The least sum of squares near where the unknowns start.

        Raises:
            ValueError: when the start itself has no residuals, naming the run.
        """
        damping = Undamped(
            raised=FIRST_DAMPING, relief=3.0, least=FIRST_DAMPING, largest=LARGEST_DAMPING
        )
        search = LevenbergMarquardt(
            self.steps, damping, level=True, slack=ROUNDING, farthest=self.farthest
        )
        start = _Place(tuple(swings), unknowns, _simulated(swings, unknowns))
        place, taken, stop = search.descend(_Blocks(self), start)
        return _packed(place.parts, place.unknowns, place.cost, taken, stop)


@dataclass(frozen=True, slots=True)
class _Step:
    shared: dict[str, Array]
    own: dict[str, Array]
    triangle: Array
    singular_values: Array
    promised: float
    is_full: bool

    @property
    def longest(self) -> float:
        """Largest change of an unknown, in its scale."""
        changes = (*self.shared.values(), *self.own.values())
        return max(float(np.abs(change).max(initial=0.0)) for change in changes)


@dataclass(frozen=True)
class _Place:
    """Unknowns with what was simulated there; cost and slopes once they are asked for."""

    swings: tuple[Swing, ...]
    unknowns: Unknowns
    made: Sequence[Any]

    @property
    def cost(self) -> float:
        return self._cost

    @cached_property
    def _cost(self) -> float:
        return _cost(self.swings, self.unknowns, self.made)

    @cached_property
    def parts(self) -> list[Part]:
        return _linearised(self.swings, self.unknowns, self.made)


@dataclass(frozen=True, slots=True)
class _Blocks:
    """The fit as the search sees it."""

    how: Dense

    def step(self, place: _Place, damping: float) -> _Step:
        return _step(place.parts, place.unknowns, damping)

    def moved(self, place: _Place, step: _Step) -> _Place | None:
        if self._is_idle(step):
            return None
        unknowns = _moved(place.unknowns, step, self.how.farthest)
        try:
            there = _Place(place.swings, unknowns, _simulated(place.swings, unknowns))
            return there if np.isfinite(there.cost) else None
        except (ValueError, np.linalg.LinAlgError):
            return None

    def ended(
        self, place: _Place, step: _Step, trial: _Place | None, lower: bool, damping: float
    ) -> Stop | None:
        if self._is_idle(step):
            return converged(f"a step would gain {step.promised:.2g}")
        gained = np.inf if trial is None or not lower else place.cost - trial.cost
        if gained < self.how.tolerance and step.promised < 10.0 * self.how.tolerance:
            return converged(f"the last step gained {gained:.2g}")
        return None

    def _is_idle(self, step: _Step) -> bool:
        return step.is_full and step.promised < self.how.tolerance


@dataclass(frozen=True, slots=True)
class LinearProblem:
    """A fit's linear problem about some unknowns, run by run, in units of their scales.

    Attributes:
        parts: of each run residuals (m,), slopes by its own unknowns and by the shared ones that
            are estimated, (m, ..) each.
        triangles: of each run over [shared estimated unknowns; residual], its own eliminated,
            (r, p + 1, p + 1).
        prior_rows: what is known of the shared ones, (q, p + 1).
    """

    parts: tuple[Part, ...]
    triangles: Array
    prior_rows: Array

    def left_over(self, run: int, change: Array) -> Array:
        """Residuals (m,) of a run once the shared unknowns change and its own follow best."""
        residuals, own, shared = self.parts[run]
        moved = residuals + shared @ change
        return np.asarray(moved - own @ np.linalg.lstsq(own, moved, rcond=RANK_LIMIT)[0])


def linear_problem(swings: Sequence[Swing], unknowns: Unknowns) -> LinearProblem:
    """Linearise a fit about some unknowns.

    Raises:
        ValueError: where a run has no motion there, naming it.

    Source:
        Bjoerck 1996, Numerical Methods for Least Squares Problems, sec. 6.3.
    """
    free = _joined([block.mask for block in unknowns.shared]).astype(bool)
    own_free = _joined([block.mask for block in unknowns.own]).astype(bool)
    parts, triangles = [], []
    size = int(free.sum()) + 1
    for residuals, own, shared in _linearised(swings, unknowns, _simulated(swings, unknowns)):
        own, shared = own[:, own_free], shared[:, free]
        rows = np.column_stack([own, shared, residuals])
        rows = np.vstack([rows, np.zeros((rows.shape[1], rows.shape[1]))])
        parts.append((residuals, own, shared))
        triangles.append(_triangle(rows)[own.shape[1] :, own.shape[1] :][:size])
    priors = _shared_priors(unknowns)[:, np.append(free, True)]
    return LinearProblem(tuple(parts), np.array(triangles), priors)


def _simulated(swings: Sequence[Swing], unknowns: Unknowns) -> list[Any]:
    return [swing.simulated(unknowns.of_run(run)) for run, swing in enumerate(swings)]


def _cost(swings: Sequence[Swing], unknowns: Unknowns, made: Sequence[Any]) -> float:
    alone = unknowns.blocks if unknowns.correlations is None else unknowns.own
    total = sum(float(np.sum(block.pull(block.value)[0] ** 2)) for block in alone)
    if unknowns.correlations is not None:
        total += float(np.sum(_shared_priors(unknowns)[:, -1] ** 2))
    for run, (swing, one) in enumerate(zip(swings, made, strict=True)):
        total += float(np.sum(swing.residuals(unknowns.of_run(run), one) ** 2))
    return total


def _linearised(swings: Sequence[Swing], unknowns: Unknowns, made: Sequence[Any]) -> list[Part]:
    """Residuals and slopes of every run in scaled unknowns, the priors of its own included."""
    found = []
    for run, (swing, one) in enumerate(zip(swings, made, strict=True)):
        residuals, slopes = swing.linearised(unknowns.of_run(run), one)
        sides = []
        for blocks in (unknowns.own, unknowns.shared):
            columns = [_columns(block, slopes, len(residuals)) for block in blocks]
            sides.append(np.hstack([np.zeros((len(residuals), 0)), *columns]))
        pulls = [block.pull(block.value[run]) for block in unknowns.own]
        scales = _joined([block.scale for block in unknowns.own])
        prior = np.diag(_joined([pull[1] for pull in pulls]) * scales)
        residuals = np.concatenate([residuals, *[pull[0] for pull in pulls]])
        own = np.vstack([sides[0], prior])
        shared = np.vstack([sides[1], np.zeros((len(prior), sides[1].shape[1]))])
        found.append((residuals, own, shared))
    return found


def _columns(block: Unknown, slopes: Mapping[str, Array], rows: int) -> Array:
    if block.name not in slopes:
        return np.zeros((rows, block.size))
    return np.asarray(slopes[block.name] * np.where(block.mask, block.scale, 0.0))


def _step(parts: list[Part], unknowns: Unknowns, damping: float) -> _Step:
    """A damped Gauss-Newton step."""
    n_own = sum(block.size for block in unknowns.own)
    held = np.where(_joined([block.mask for block in unknowns.own]), 0.0, 1.0)
    reduced, triangles = [], []
    curvature = np.sum(_shared_priors(unknowns)[:, :-1] ** 2, axis=0)
    for residuals, own, shared in parts:
        rows = np.column_stack([own, shared, residuals])
        more = np.zeros((2 * n_own, rows.shape[1]))
        more[:n_own, :n_own] = np.diag(np.sqrt(damping) * np.linalg.norm(own, axis=0))
        more[n_own:, :n_own] = np.diag(held)
        curvature = curvature + np.sum(shared**2, axis=0)
        triangle = _triangle(np.vstack([rows, more]))
        triangles.append(triangle[:n_own])
        reduced.append(triangle[n_own:, n_own:])
    damped = np.zeros((len(curvature), len(curvature) + 1))
    damped[:, :-1] = np.diag(np.sqrt(damping * curvature))
    rows = np.vstack([*reduced, _shared_priors(unknowns), damped])
    free = _joined([block.mask for block in unknowns.shared]).astype(bool)
    kept = np.append(free, True)
    full = _triangle(np.vstack([rows[:, kept], np.zeros((kept.sum(), kept.sum()))]))
    count = int(free.sum())
    triangle, right = full[:count, :count], full[:count, -1]
    left, singular, back = np.linalg.svd(triangle)
    counts = singular > RANK_LIMIT * singular.max(initial=0.0)
    gains = np.where(counts, 1.0 / np.where(counts, singular, 1.0), 0.0)
    change = np.zeros(len(free))
    change[free] = -(back.T @ (gains * (left.T @ right)))
    own_changes = [
        -_solved(one[:, :n_own], one[:, n_own:-1] @ change + one[:, -1]) for one in triangles
    ]
    gain = float(right @ right) + sum(float(one[:, -1] @ one[:, -1]) for one in triangles)
    return _Step(
        _by_block(unknowns.shared, change),
        _by_block(unknowns.own, np.array(own_changes)),
        triangle,
        singular,
        gain,
        damping == 0.0,
    )


def _triangle(rows: Array) -> Array:
    return np.asarray(np.linalg.qr(rows, mode="r"))


def _solved(triangle: Array, right: Array) -> Array:
    return np.asarray(np.linalg.lstsq(triangle, right, rcond=RANK_LIMIT)[0])


def _shared_priors(unknowns: Unknowns) -> Array:
    """What is known of the shared unknowns, a row a number, over [scaled unknowns; distance]."""
    shared = unknowns.shared
    scales = _joined([block.scale for block in shared])
    if unknowns.correlations is not None:
        means, whitened = unknowns.known_of(*(block.name for block in shared))
        values = _joined([block.value for block in shared])
        return np.column_stack([whitened * scales, whitened @ (values - means)])
    pulls = [block.pull(block.value) for block in shared]
    slopes = np.diag(_joined([pull[1] for pull in pulls]) * scales)
    return np.column_stack([slopes, _joined([pull[0] for pull in pulls])])


def _by_block(blocks: Sequence[Unknown], scaled: Array) -> dict[str, Array]:
    """Scaled changes (.., all sizes) as changes by block."""
    found, first = {}, 0
    for block in blocks:
        found[block.name] = scaled[..., first : first + block.size]
        first += block.size
    return found


def _moved(unknowns: Unknowns, step: _Step, farthest: float) -> Unknowns:
    share = min(1.0, farthest / max(step.longest, 1e-300))
    moves = {}
    for name, change in {**step.shared, **step.own}.items():
        block = unknowns.block(name)
        moves[name] = block.value + share * block.scale * change
    return unknowns.moved(moves)


def _packed(parts: list[Part], unknowns: Unknowns, cost: float, taken: int, stop: Stop) -> Solution:
    step = _step(parts, unknowns, 0.0)
    free = _joined([block.mask for block in unknowns.shared]).astype(bool)
    scales = _joined([block.scale for block in unknowns.shared])
    kept = step.singular_values > RANK_LIMIT * step.singular_values.max(initial=0.0)
    covariance = shared_covariance(step.triangle, bool(kept.all()), free, scales)
    n_own = sum(block.size for block in unknowns.own)
    white = tuple(residuals[: len(residuals) - n_own] for residuals, _, _ in parts)
    rank = int(kept.sum())
    return Solution(unknowns, covariance, cost, white, step.singular_values, rank, taken, stop)


def _joined(parts: Sequence[Array]) -> Array:
    return np.concatenate([np.zeros(0), *parts])
