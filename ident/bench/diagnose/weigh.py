"""A bench fit weighed: what left-out runs say of it, and how probable it is beside others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.bench.diagnose.causes import Cause
from freeswing.ident.bench.noise import column_residuals
from freeswing.ident.bench.swing import BenchSwing
from freeswing.ident.diagnose.leave_one_out import Evidence, Score, score
from freeswing.ident.diagnose.model_probabilities import Rival, model_probabilities
from freeswing.ident.likelihood.fit import Solution
from freeswing.ident.likelihood.fit_blocks import LinearProblem, linear_problem


@dataclass(frozen=True)
class Fit:
    """One model fitted.

    Attributes:
        swings: with their noise.
        solution: of the fit.
        causes: that the model has beside drag and wires.
    """

    swings: tuple[BenchSwing, ...]
    solution: Solution
    causes: tuple[Cause, ...] = ()

    @cached_property
    def linear(self) -> LinearProblem:
        """The linear problem about it."""
        return linear_problem(self.swings, self.solution.unknowns)

    @cached_property
    def squares(self) -> Array:
        """Sum of each run's squared whitened residuals, (r,).

        Once the noise was set by them it is how many independent numbers a run measured.
        """
        return np.array([float(np.sum(part**2)) for part in self.solution.residuals])

    def evidence(self, counts: Array) -> Evidence:
        """Its linear problem as evidence, of runs that measured so many numbers, (r,)."""
        names = tuple(swing.name for swing in self.swings)
        return Evidence(names, self.linear.triangles, counts, self.linear.prior_rows)

    @cached_property
    def score(self) -> Score:
        """What it makes of runs that are left out, one at a time."""
        return score(self.evidence(self.squares))

    def left_out(self) -> tuple[Array, Array]:
        """Rms of left-out runs' residuals in m and in rad, (r,) each; NaN: none measured so.

        All that runs share is found without a run, and its own start from all of its samples.
        """
        evidence, units = self.evidence(self.squares), []
        for k, swing in enumerate(self.swings):
            others = np.delete(evidence.triangles, k, axis=0)
            rows = np.vstack([others.reshape(-1, others.shape[-1]), evidence.prior_rows])
            change = -np.linalg.lstsq(rows[:, :-1], rows[:, -1], rcond=None)[0]
            units.append(by_unit(swing, self.linear.left_over(k, change)))
        return tuple(np.array(one) for one in zip(*units, strict=True))  # type: ignore[return-value]

    def rival(self, claims: int, own: int) -> Rival:
        """The model among others.

        Args:
            claims: how many effects it claims.
            own: how many numbers it gives to every run beyond the smallest model.
        """
        rows = self.linear.prior_rows
        # An unknown of which nothing is known lies within its usual size: so in every rival.
        flat = np.eye(rows.shape[1])[:-1]
        known = np.any(rows[:, :-1] != 0.0, axis=0)
        prior = np.vstack([rows[np.any(rows[:, :-1] != 0.0, axis=1)], flat[~known]])
        tries = 0.5 * own * float(np.sum(np.log(self.squares)))
        return Rival(self.linear.triangles, prior, claims, tries)


def by_unit(swing: BenchSwing, white: Array) -> tuple[float, float]:
    """Rms of a run's whitened residuals in m and in rad; NaN where no column is in it."""
    squares: tuple[list[Array], list[Array]] = ([], [])
    for column, part in zip(swing.columns, column_residuals(swing, white), strict=False):
        if column.coordinate is not None:
            off = part * (column.factor * column.std)[column.known]
            squares[column.coordinate // 3].append(off**2)
    return tuple(  # type: ignore[return-value]
        float(np.sqrt(np.mean(np.concatenate(one)))) if one else np.nan for one in squares
    )


def chances(fits: Sequence[Fit], counts: Array) -> Array:
    """Probability of each of some fits under the same noise, (m,).

    Args:
        fits: of which each cause is a claim.
        counts: how many independent numbers each run measured, (r,).

    Source:
        MacKay 2003, Information Theory, Inference, and Learning Algorithms, ch. 28.
    """
    rivals = [fit.rival(len(fit.causes), 0) for fit in fits]
    return model_probabilities(rivals, counts, counts)


def needed(without: Fit, whole: Fit, own: int) -> float:
    """Probability that what a fit has beside one without it is there, of these two alone.

    Args:
        without: the fit without one thing.
        whole: the fit that has it, by whose noise both are weighed.
        own: how many numbers of it each run has for itself.
    """
    rivals = [without.rival(0, 0), whole.rival(1, own)]
    return float(model_probabilities(rivals, whole.squares, whole.squares)[1])
