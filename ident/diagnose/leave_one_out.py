"""Linearised evidence of all runs, and what any set of unknowns makes of it.

Each run contributes a triangle over [shared unknowns; residual] from which its own unknowns (start
state, lengths) are eliminated. With these few numbers a run, every subset of unknowns can be
solved, scored on runs that were left out, and told apart, without another simulation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from freeswing.cdpr.measured.leaving_out import leaving_out_std
from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.own_values import OwnValues

# Of the largest singular value: what is below cannot be told from rounding.
NO_RANK = 1e-10


@dataclass(frozen=True, slots=True)
class Evidence:
    """Whitened linear equations, run by run.

    Attributes:
        runs: names, (r,).
        triangles: over [unknowns; residual], (r, p + 1, p + 1); the last diagonal element is what
            no unknown can explain.
        counts: how many numbers each run measured, less its own unknowns, (r,).
        prior_rows: weak priors, (q, p + 1).
        common: how many of the unknowns, the last ones, are amplitudes of errors that the poses of
            all runs share: they stand beside every set of the others.
        own: what the runs know of effect values that each has for itself; None where none has.
        plucked: what the runs know of how their starts pluck cables; None where these are held.
    """

    runs: tuple[str, ...]
    triangles: Array
    counts: Array
    prior_rows: Array
    common: int = 0
    own: OwnValues | None = None
    plucked: OwnValues | None = None

    def columns(self, chosen: np.ndarray) -> np.ndarray:
        """Those of chosen unknowns, of what stands beside every set, and of the residual."""
        size = self.triangles.shape[-1]
        return np.concatenate([chosen, np.arange(size - 1 - self.common, size)])

    def subset(self, columns: np.ndarray) -> Evidence:
        """The evidence with only some of the unknowns, the others held."""
        kept = self.columns(columns)
        reduced = np.asarray(np.linalg.qr(self.triangles[:, :, kept], mode="r"))
        prior = self.prior_rows[:, kept]
        prior = prior[np.abs(prior[:, :-1]).sum(axis=1) > 0]
        beside = self.common, self.own, self.plucked
        return Evidence(self.runs, reduced, self.counts, prior, *beside)


@dataclass(frozen=True, slots=True)
class Score:
    """What a set of unknowns makes of the evidence.

    Attributes:
        change: of the unknowns, (p,).
        std: of that change for white noise, (p,).
        jackknife_std: from leaving out one run at a time, (p,).
        cost: sum of squares over all runs after the change.
        held_out: sum of squares of each run with the change found on the others, counted with the
            covariance of that prediction, (r,).
        wider: logarithm of that covariance's determinant over the noise's, and what a start that
            plucks cables pays, (r,).
        rank: of the joint problem.
    """

    change: Array
    std: Array
    jackknife_std: Array
    cost: float
    held_out: Array
    wider: Array
    rank: int

    @property
    def surprise(self) -> Array:
        """Of each run, left out: twice its negative log density, but for a constant, (r,)."""
        return self.held_out + self.wider


def score(evidence: Evidence) -> Score:
    """Solve for all unknowns of the evidence, and again without each run."""
    r, size, _ = evidence.triangles.shape
    p = size - 1
    scale = _column_scale(evidence)
    whole = _solve(evidence.triangles.reshape(-1, size), evidence.prior_rows, scale)
    changes = np.empty((r, p))
    held_out, wider = np.empty(r), np.empty(r)
    for k in range(r):
        others = np.delete(evidence.triangles, k, axis=0).reshape(-1, size)
        without = _solve(others, evidence.prior_rows, scale)
        changes[k] = without.change
        held_out[k], wider[k] = _predicted(evidence.triangles[k], without)
    if evidence.plucked is not None:
        wider -= 2.0 * evidence.plucked.likeliest()[1]
    jackknife = leaving_out_std(changes)
    fitted = evidence.triangles.reshape(-1, size) @ np.append(whole.change, 1.0)
    cost = float(fitted @ fitted)
    return Score(whole.change, whole.std, jackknife, cost, held_out, wider, whole.rank)


def _predicted(triangle: Array, others: Solution) -> tuple[float, float]:
    """Squares of a run that others predict, and how much wider that is than noise (`Score`).

    Near a singularity a run answers to everything at once, by more than the others know: what
    these leave open is no error of a model.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.3.2: the predictive
        distribution.
    """
    error = triangle @ np.append(others.change, 1.0)
    along, sizes, _ = np.linalg.svd(triangle[:, :-1] @ others.root)
    variances = 1.0 + np.append(sizes, np.zeros(len(error) - len(sizes))) ** 2
    return float(np.sum((along.T @ error) ** 2 / variances)), float(np.log(variances).sum())


def _column_scale(evidence: Evidence) -> Array:
    norms = np.sqrt(np.sum(evidence.triangles[:, :, :-1] ** 2, axis=(0, 1)))
    return 1.0 / np.where(norms > 0.0, norms, 1.0)


class Solution(NamedTuple):
    """Of a linear problem.

    Attributes:
        change: of the unknowns, (p,).
        root: of its covariance for white noise: that is root root^T, (p, p).
        rank: of the problem; what is beyond may be anything.
    """

    change: Array
    root: Array
    rank: int

    @property
    def std(self) -> Array:
        """Standard deviations of the change, of what can be told, (p,)."""
        return np.sqrt(np.sum(self.root[:, : self.rank] ** 2, axis=1))


def _solve(rows: Array, prior: Array, scale: Array) -> Solution:
    """Least-squares change with its covariance and the rank."""
    stacked = np.vstack([rows, prior])
    matrix = stacked[:, :-1] * scale
    left, singular, right = np.linalg.svd(matrix, full_matrices=False)
    least = NO_RANK * singular.max(initial=0.0)
    kept = singular > least
    inverse = np.where(kept, 1.0 / np.where(kept, singular, 1.0), 0.0)
    change = -scale * (right.T @ (inverse * (left.T @ stacked[:, -1])))
    floor = max(least, np.finfo(float).tiny)
    root = scale[:, None] * right.T / np.maximum(singular, floor)
    return Solution(change, root, int(kept.sum()))
