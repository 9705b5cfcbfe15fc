"""Least squares with an arrow for a normal matrix: a small block a pose and one border for all.

Levenberg-Marquardt with the poses eliminated (Schur complement), so that time and memory grow with
the number of poses and not with its cube. Marquardt's scaling, Nielsen's rule for the damping.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.descent import AT_ROUNDING, LevenbergMarquardt, Nielsen, Stop, converged

Array = NDArray[np.float64]

_RANK_LIMIT = 1e-13
_SETTLED = 1e-11
_DAMPING = Nielsen(ease=1 / 30, least=1e-15, growth=2.0, faster=2.0)
_STRAIGHT = 0.03


@dataclass(frozen=True, slots=True)
class Linearization:
    """Whitened residuals and their derivatives.

    Attributes:
        residuals: (N, m).
        by_block: derivatives by the unknowns of each pose, (N, m, p).
        by_border: derivatives by the shared unknowns, (N, m, b).
        prior: whitened departures of the border from what was known before, (b,).
        prior_weight: one over the prior's standard deviations, (b,); 0 where nothing was known.
    """

    residuals: Array
    by_block: Array
    by_border: Array
    prior: Array
    prior_weight: Array


Linearize = Callable[[Array, Array], Linearization]


@dataclass(frozen=True, slots=True)
class ArrowSolution:
    """Where the iteration stopped.

    Attributes:
        blocks: unknowns of each pose, (N, p).
        border: shared unknowns, (b,).
        linearization: at the solution, without the robust weights.
        weights: robust weights at the solution, (N, m), 1 for an ordinary residual.
        cost: half the robust sum of squares.
        iterations: linearizations used.
        stop: a sentence.
        converged: False when the iterations ran out.
    """

    blocks: Array
    border: Array
    linearization: Linearization
    weights: Array
    cost: float
    iterations: int
    stop: str
    converged: bool


@dataclass(frozen=True, slots=True)
class ArrowCovariance:
    """Covariance of an arrow's unknowns, never formed as a whole.

    Attributes:
        border: (b, b); NaN when the rank is short.
        gain: A^-1 B of each pose, (N, p, b).
        block_inverse: A^-1 of each pose, (N, p, p).
        singular_values: of the border's reduced Jacobian, in the border's own units, falling, (b,).
        rank: how many of them the readings determine.
    """

    border: Array
    gain: Array
    block_inverse: Array
    singular_values: Array
    rank: int

    @property
    def conditioning(self) -> float:
        """Largest over smallest singular value of the border's reduced Jacobian."""
        return float(self.singular_values[0] / self.singular_values[-1])

    def blocks(self) -> Array:
        """Covariance of each pose, (N, p, p)."""
        return self.block_inverse + self.gain @ self.border @ self.gain.swapaxes(1, 2)

    def block(self, index: int) -> Array:
        """Covariance of one pose, (p, p)."""
        gain = self.gain[index]
        return self.block_inverse[index] + gain @ self.border @ gain.T

    def predicted(self, by_block: Array, by_border: Array) -> Array:
        """Variance of each fitted residual, (N, m), from the derivatives of `Linearization`."""
        through = by_border - by_block @ self.gain
        own = np.einsum("nmp,npq,nmq->nm", by_block, self.block_inverse, by_block, optimize=True)
        return own + np.einsum("nmb,bc,nmc->nm", through, self.border, through, optimize=True)


def huber_weights(residuals: Array, limit: float) -> Array:
    """Weights of Huber's loss: 1 up to `limit` standard deviations, then limit / |residual|.

    Source:
        Huber 1981, Robust Statistics, ch. 7.
    """
    return limit / np.maximum(np.abs(residuals), limit) if np.isfinite(limit) else residuals * 0 + 1


def solve_arrow(
    linearize: Linearize,
    blocks: Array,
    border: Array,
    *,
    loss_limit: float = np.inf,
    tolerance: float = 1e-12,
    max_iterations: int = 100,
) -> ArrowSolution:
    """Minimise the (Huber) sum of squares over blocks (N, p) and border (b,).

    A step is final when it changes no unknown by more than `tolerance`, or when the cost has
    settled or cannot fall any more in double precision.
    """
    search = _Search(linearize, loss_limit, tolerance)
    solver = LevenbergMarquardt(max_iterations, _DAMPING)
    ended, count, stop = solver.descend(search, search.at(blocks, border))
    weights = huber_weights(ended.linearization.residuals, loss_limit)
    return ArrowSolution(
        ended.blocks,
        ended.border,
        ended.linearization,
        weights,
        ended.cost,
        count,
        stop.sentence,
        stop.converged,
    )


@dataclass(frozen=True, slots=True)
class _At:
    """Unknowns, and the residuals and robust cost there."""

    blocks: Array
    border: Array
    linearization: Linearization
    cost: float


@dataclass(frozen=True, slots=True)
class _Step:
    """Changes of the unknowns, and by what they lower the cost to first order."""

    blocks: Array
    border: Array
    promised: float

    @property
    def size(self) -> float:
        """Largest change."""
        return max(np.abs(self.blocks).max(), np.abs(self.border).max())


class _Search:
    """A problem as `LevenbergMarquardt` takes it; the equations of a place are made once."""

    def __init__(self, linearize: Linearize, loss_limit: float, tolerance: float) -> None:
        self.linearize, self.loss_limit, self.tolerance = linearize, loss_limit, tolerance
        self._equations: tuple[_At, tuple[Array, ...]] | None = None

    def at(self, blocks: Array, border: Array) -> _At:
        """A place of the search."""
        found = self.linearize(blocks, border)
        return _At(blocks, border, found, _robust_cost(found, self.loss_limit))

    def step(self, place: _At, damping: float) -> _Step:
        """With every pose eliminated."""
        if self._equations is None or self._equations[0] is not place:
            self._equations = place, _normal_equations(place.linearization, self.loss_limit)
        return _Step(*_damped_step(self._equations[1], damping))

    def moved(self, place: _At, step: _Step) -> _At:
        """The place after a step."""
        return self.at(place.blocks + step.blocks, place.border + step.border)

    def ended(
        self, place: _At, step: _Step, trial: _At | None, lower: bool, damping: float
    ) -> Stop | None:
        """Once nothing changes any more, or cannot in double precision."""
        small = step.size < self.tolerance
        if trial is not None and lower:
            if small:
                return converged("a small step")
            settled = place.cost - trial.cost < _SETTLED * trial.cost
            return converged("the cost has settled") if settled else None
        return AT_ROUNDING if small or step.promised <= 1e-14 * place.cost else None


def covariance(linearization: Linearization, weights: Array) -> ArrowCovariance:
    """Covariance for whitened residuals, with the rank of the border.

    The border's covariance is NaN where `rank` falls short of its size.
    """
    block, mixed, border, _, _ = _weighted(linearization, weights, weights)
    inverse: Array = np.linalg.inv(block).astype(np.float64)
    gain = inverse @ mixed
    reduced = border - np.einsum("npb,npc->bc", mixed, gain)
    reduced = (reduced + reduced.T) / 2
    scale = 1 / np.sqrt(np.maximum(np.diag(border), 1e-300))
    share = np.linalg.eigvalsh(reduced * np.outer(scale, scale))
    rank = int((share > _RANK_LIMIT * len(weights)).sum())
    values = np.sqrt(np.maximum(np.linalg.eigvalsh(reduced)[::-1], 1e-300))
    known = rank == len(border)
    result = np.linalg.inv(reduced) if known else np.full_like(reduced, np.nan)
    return ArrowCovariance(result, gain, inverse, values, rank)


def _robust_cost(linearization: Linearization, limit: float) -> float:
    size = np.abs(linearization.residuals)
    inside = np.minimum(size, limit)
    beyond = 0.0 if np.isinf(limit) else limit * (size - inside).sum()
    return float(0.5 * (inside**2).sum() + beyond + 0.5 * (linearization.prior**2).sum())


def _weighted(
    linearization: Linearization, weights: Array, curvatures: Array
) -> tuple[Array, Array, Array, Array, Array]:
    """Blocks, mixed part and border of the normal matrix, and both gradients."""
    by_block = linearization.by_block
    turned = (by_block * curvatures[..., None]).swapaxes(1, 2)
    flat = linearization.by_border.reshape(-1, linearization.by_border.shape[-1])
    heavy = flat * curvatures.reshape(-1, 1)
    residuals = linearization.residuals * weights
    return (
        turned @ by_block,
        turned @ linearization.by_border,
        flat.T @ heavy + np.diag(linearization.prior_weight**2),
        np.einsum("nmp,nm->np", by_block, residuals),
        flat.T @ residuals.ravel() + linearization.prior_weight * linearization.prior,
    )


def _normal_equations(
    linearization: Linearization, limit: float
) -> tuple[Array, Array, Array, Array, Array]:
    """Huber's loss is straight beyond its limit: little curvature there, or steps come short."""
    weights = huber_weights(linearization.residuals, limit)
    return _weighted(linearization, weights, np.where(weights < 1, _STRAIGHT * weights, weights))


def _damped_step(normal: tuple[Array, ...], damping: float) -> tuple[Array, Array, float]:
    """Steps of the blocks and the border, and the fall of cost that the linear model promises."""
    block, mixed, border, slope_block, slope_border = normal
    diagonal = np.einsum("npp->np", block)
    damped = block.copy()
    np.einsum("npp->np", damped)[...] += damping * diagonal + 1e-300
    solved = np.linalg.solve(damped, np.concatenate([mixed, slope_block[..., None]], axis=-1))
    gain, shift = solved[..., :-1], solved[..., -1]
    reduced = border - np.einsum("npb,npc->bc", mixed, gain, optimize=True)
    np.einsum("bb->b", reduced)[...] += damping * np.diag(border) + 1e-300
    right = slope_border - np.einsum("npb,np->b", mixed, shift, optimize=True)
    step_border = -np.linalg.solve(reduced, right)
    step_blocks = -(shift + gain @ step_border)
    linear = -(slope_block * step_blocks).sum() - slope_border @ step_border
    quadratic = (damping * diagonal * step_blocks**2).sum() + damping * (
        np.diag(border) @ step_border**2
    )
    return step_blocks, step_border, float(0.5 * (linear + quadratic))
