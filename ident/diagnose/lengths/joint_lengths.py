"""One joint model of all that changes cable lengths.

Anchors, attachments, radii, axes, what is measured, creep and stretch stand side by side. Each
block of them is either as declared, within its tolerance, or grossly off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.lengths.length_noise import repetition, slow_size
from freeswing.ident.diagnose.lengths.length_rows import LengthRows

# A run whose lengths keep this many times as much as the usual run's weighs less.
WORSE = 1.5


@dataclass(frozen=True, slots=True)
class Blocks:
    """Which unknowns belong together.

    Attributes:
        columns: places of each block's unknowns among the shared ones.
        tolerance: standard deviation of each unknown where all is as declared, (p,).
        gross: and where its block is wrong, (p,).
    """

    columns: dict[str, np.ndarray]
    tolerance: Array
    gross: Array

    def spread(self, wrong: Sequence[str]) -> Array:
        """Prior standard deviations with some blocks wrong, (p,)."""
        found = self.tolerance.copy()
        for key in wrong:
            found[self.columns[key]] = self.gross[self.columns[key]]
        return found


@dataclass(frozen=True, slots=True)
class Normal:
    """Normal equations of each run after its own unknowns were eliminated.

    Attributes:
        matrices: (r, p, p).
        rights: (r, p).
        squares: of what is left with all unknowns at zero, (r,).
        rows: of the runs.
        sizes: of the slow errors of each run, (r,).
    """

    matrices: Array
    rights: Array
    squares: Array
    rows: tuple[LengthRows, ...]
    sizes: Array

    def variations_m(self, values: Array) -> Array:
        """What unknowns (p,) leave of each run's lengths along it, root mean square, (r,)."""
        pairs = zip(self.rows, self.sizes, strict=True)
        left = [_left(one, _reduced(one, size), values) for one, size in pairs]
        return np.array([np.sqrt(np.mean(rest**2)) for rest in left])


@dataclass(frozen=True, slots=True)
class Solved:
    """A Gaussian of the shared unknowns.

    Attributes:
        values: (p,).
        covariance: (p, p).
        log_evidence: up to a constant that all sets share.
    """

    values: Array
    covariance: Array
    log_evidence: float


def normal_equations(rows: Sequence[LengthRows], widest: Array) -> Normal:
    """Normal equations with slow errors as large, and as repetitive, as each run asks for.

    A run with a spoiled marker has larger ones than the others, and weighs less: where the least
    size is that of all runs, those that leave more of their lengths than the usual one have larger
    errors in proportion. Of fifteen recorded runs three would otherwise settle the answer.

    Args:
        rows: of all runs.
        widest: prior standard deviations with everything wrong, (p,).
    """
    least = np.array([one.least_size for one in rows])
    sizes = least
    share = len(widest) / len(rows)
    freedom = [one.right.size - one.own.shape[2] - share for one in rows]
    if min(freedom) <= 0.0:
        raise ValueError("too few samples for the unknowns of the geometry")
    for _ in range(3):
        found = [_reduced(*pair) for pair in zip(rows, sizes, strict=True)]
        solution = solved(_summed(found), widest)
        left = [_left(one, part, solution.values) for one, part in zip(rows, found, strict=True)]
        own = [_own_size(*run) for run in zip(rows, left, freedom, strict=True)]
        sizes = np.maximum(least, own)
    return renewed(tuple(rows), _in_proportion(rows, sizes, widest))


def renewed(rows: tuple[LengthRows, ...], sizes: Array) -> Normal:
    """Normal equations of rows whose slow errors have known sizes (r,)."""
    found = [_reduced(*pair) for pair in zip(rows, sizes, strict=True)]
    matrices = np.array([part.matrix for part in found])
    rights, squares = np.array([p.right for p in found]), np.array([p.square for p in found])
    return Normal(matrices, rights, squares, rows, sizes)


def _in_proportion(rows: Sequence[LengthRows], usual: Array, widest: Array) -> Array:
    """Sizes raised where a run leaves more of its lengths than the median run, (r,)."""
    sizes = usual
    for _ in range(3):
        found = [_reduced(*pair) for pair in zip(rows, sizes, strict=True)]
        solution = solved(_summed(found), widest)
        left = [_left(one, part, solution.values) for one, part in zip(rows, found, strict=True)]
        squares = [np.mean(_whitened(*r) ** 2) for r in zip(rows, usual, left, strict=True)]
        worse = np.sqrt(squares / np.maximum(np.median(squares), 1e-300))
        sizes = usual * np.where(worse > WORSE, worse, 1.0)
    return sizes


def solved(summed: tuple[Array, Array, float], spread: Array) -> Solved:
    """The Gaussian of the unknowns from summed normal equations and independent priors."""
    matrix, right, square = summed
    scaled = matrix * np.outer(spread, spread) + np.eye(len(spread))
    factor = np.linalg.cholesky(scaled)
    half = np.linalg.solve(factor, spread * right)
    inverse = np.linalg.inv(factor) * spread
    values = -inverse.T @ half
    evidence = -0.5 * (square - float(half @ half)) - float(np.log(np.diag(factor)).sum())
    return Solved(values, inverse.T @ inverse, evidence)


def total(normal: Normal, without: int | None = None) -> tuple[Array, Array, float]:
    """Sums over the runs, one of them left out or not."""
    kept = np.arange(len(normal.rights)) != (-1 if without is None else without)
    return (
        normal.matrices[kept].sum(axis=0),
        normal.rights[kept].sum(axis=0),
        float(normal.squares[kept].sum()),
    )


def log_odds(normal: Normal, blocks: Blocks, wrong: Sequence[str], key: str) -> float:
    """Log of the evidence for a block's being wrong beside the others of a set."""
    summed, others = total(normal), [one for one in wrong if one != key]
    with_it = solved(summed, blocks.spread(wrong)).log_evidence
    return with_it - solved(summed, blocks.spread(others)).log_evidence


def honest_covariance(normal: Normal, spread: Array, found: Solved) -> Array:
    """The larger, in every direction, of the posterior's covariance and of that over runs.

    How the runs' scores differ gives a covariance without any model of the noise (a sandwich, the
    jackknife to first order). Where it is the smaller one the posterior stays.

    Source:
        White 1982, Maximum Likelihood Estimation of Misspecified Models: the
        sandwich; the larger in every direction by Golub, Van Loan 2013, Matrix
        Computations, sec. 8.7.
    """
    scores = normal.matrices @ found.values + normal.rights
    scores = scores - scores.mean(axis=0)
    count = len(scores)
    between = count / max(count - 1.0, 1.0) * scores.T @ scores
    root = np.linalg.cholesky(found.covariance + 1e-12 * np.diag(spread**2))
    sizes, axes = np.linalg.eigh(root.T @ between @ root)
    turned = root @ axes
    return (turned * np.maximum(sizes, 1.0)) @ turned.T


@dataclass(frozen=True, slots=True)
class _Part:
    matrix: Array
    right: Array
    square: float
    own: Array
    own_inverse: Array
    weights: Array


def _reduced(rows: LengthRows, size: float) -> _Part:
    """Normal equations without a run's own unknowns: its lengths free, its frame of unit prior."""
    weights = np.linalg.inv(rows.white + size**2 * rows.slow)
    n, n_own = rows.right.shape[1], rows.own.shape[2]
    everything = np.concatenate([rows.own, rows.shared, rows.right[..., None]], axis=2)
    gram = np.einsum("bia,bij,bjc->ac", everything, weights, everything, optimize=True)
    prior = np.zeros(n_own)
    prior[n:] = 1.0
    if rows.beside is not None:
        gram = rows.weight * gram + rows.beside.T @ rows.beside
        prior[:n] = float(rows.weight == 0.0)
    own = gram[:n_own, :n_own] + np.diag(prior)
    inverse = np.linalg.inv(own)
    rest = gram[n_own:, n_own:] - gram[n_own:, :n_own] @ inverse @ gram[:n_own, n_own:]
    return _Part(rest[:-1, :-1], rest[:-1, -1], float(rest[-1, -1]), gram, inverse, weights)


def _summed(parts: Sequence[_Part]) -> tuple[Array, Array, float]:
    return (
        np.sum([part.matrix for part in parts], axis=0),
        np.sum([part.right for part in parts], axis=0),
        float(sum(part.square for part in parts)),
    )


def _left(rows: LengthRows, part: _Part, values: Array) -> Array:
    """What the shared unknowns and the run's own ones leave of its lengths, (b, n)."""
    n_own = rows.own.shape[2]
    change = np.concatenate([values, [1.0]])
    own = -part.own_inverse @ (part.own[:n_own, n_own:] @ change)
    return rows.right + rows.shared @ values + rows.own @ own


def _own_size(rows: LengthRows, left: Array, freedom: float) -> float:
    """Size of a run's slow errors, as large as if their repetitions were independent."""
    size = slow_size([rows], [left], freedom)
    return size * float(np.sqrt(repetition([_whitened(rows, size, left)]))) if size else 0.0


def _whitened(rows: LengthRows, size: float, left: Array) -> Array:
    factor = np.linalg.cholesky(rows.white + size**2 * rows.slow)
    return np.linalg.solve(factor, left[..., None])[..., 0]
