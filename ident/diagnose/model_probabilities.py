"""Probabilities of rival models from the evidence of their runs.

The evidence of a model is the integral of its likelihood over its unknowns, each with a prior of
physical size, to second order about the fit (MacKay 2003, ch. 28): what an unknown could have been
and is not counts against it, so that twelve offsets of anchors do not win by their number. What a
run's residuals exceed the noise is a discrepancy of unknown size. Since none of this is ever quite
true, the shares are averages over random weights of the runs (bagged posteriors: Huggins, Miller
2023; with the Bayesian bootstrap): what one run alone says is never sure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.own_values import OwnValues

DRAWS = 200
SEED = 20201
# One effect in thirty of a catalogue of twenty is there: something is missing every second time.
CHANCE_OF_EFFECT = 1.0 / 30.0
ROUNDS = 4


@dataclass(frozen=True, slots=True)
class Rival:
    """A model in the linear problem about its fit.

    Attributes:
        triangles: of each run over [unknowns; residual], in units of the noise, (r, q + 1, q + 1).
        prior: rows over [unknowns; residual], each with a deviation of one, (k, q + 1); no
            unknown is without one.
        effects: how many it has: each is improbable beforehand.
        tries: logarithm of how many ways of it were tried beside this one.
        own: what the runs know of effect values that each has for itself; None where none has.
        plucked: what the runs know of how their starts pluck cables; None where these are held.
    """

    triangles: Array
    prior: Array
    effects: int
    tries: float = 0.0
    own: OwnValues | None = None
    plucked: OwnValues | None = None


def log_predictive(squares: Array, counts: Array, independent: Array) -> Array:
    """Log density of runs whose noise is white beside a discrepancy of unknown size, as `squares`.

    What a run's whitened squares exceed their number is a discrepancy that holds `independent`
    numbers, with whatever variance makes it likeliest. At the noise this is minus half the squares;
    far above it a factor counts, since nobody knows the size of what is missing.

    Args:
        squares: of each run's whitened residuals, (..., r).
        counts: how many numbers each run measured, (r,).
        independent: how many of them the discrepancy moves independently, (r,).

    Source:
        MacKay 2003, Information Theory, Inference, and Learning Algorithms, ch. 28.
    """
    excess = np.asarray(squares) - counts
    above = -0.5 * independent * np.log1p(np.maximum(excess, 0.0) / independent)
    return above + 0.5 * np.maximum(-excess, 0.0)


class Prediction(Protocol):
    """What others make of each run: a score (`leave_one_out.Score`)."""

    @property
    def held_out(self) -> Array:
        """Sum of squares of each run, (r,)."""
        ...

    @property
    def wider(self) -> Array:
        """Log determinant of its covariance over the noise's, (r,)."""
        ...


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Runs that were left out, and what a prediction of them is worth.

    Squares of runs far above the noise differ by hundreds, and one of them would decide for all.
    Their log densities, the size of what is missing being unknown, compare runs of any size.

    Attributes:
        stands: what the model that stands makes of each run, left out.
        counts: how many numbers each run measured, (r,).
        independent: how many of them what is missing moves independently, (r,).
        least: excess over the noise, as a share of the noise, below which a share means nothing.
    """

    stands: Prediction
    counts: Array
    independent: Array
    least: float

    def gains(self, instead: Prediction) -> Array:
        """Gain in log density of each run where it is predicted so instead, (r,).

        What a model leaves open of a run is charged by how much wider it predicts it.
        """
        now, then = (
            log_predictive(one.held_out, self.counts, self.independent) - 0.5 * one.wider
            for one in (instead, self.stands)
        )
        return now - then

    def share(self, instead: Prediction) -> float:
        """Share of the excess over the noise that is taken away: the runs' geometric mean.

        Source:
            MacKay 2003, Information Theory, Inference, and Learning Algorithms, ch. 28: by the
            densities of `log_predictive`.
        """
        whole = -log_predictive(self.stands.held_out, self.counts, self.independent).sum()
        floor = log_predictive((1.0 + self.least) * self.counts, self.counts, self.independent)
        excess = 2.0 * max(float(whole), -float(floor.sum())) / self.independent.sum()
        taken = 2.0 * float(self.gains(instead).sum()) / self.independent.sum()
        return float(np.expm1(-taken) / np.expm1(-excess))


def log_evidence(rival: Rival, counts: Array, independent: Array, weights: Array) -> Array:
    """Log evidence of a model under each set of weights of the runs, (d,).

    Args:
        rival: the model.
        counts: how many numbers each run measured, (r,).
        independent: how many of them a discrepancy moves independently, (r,).
        weights: of the runs, (d, r).

    Source:
        MacKay 2003, Information Theory, Inference, and Learning Algorithms, chapter 28.
    """
    prior = rival.prior.T @ rival.prior
    squares, curves, change = _likeliest(rival, counts, independent, weights)
    found = np.sum(weights * log_predictive(squares, counts, independent), axis=1)
    away = np.einsum("da,ab,db->d", change, prior, change)
    wider = np.linalg.slogdet(curves[:, :-1, :-1])[1] - np.linalg.slogdet(prior[:-1, :-1])[1]
    for own in (rival.own, rival.plucked):
        found = found if own is None else found + own.log_evidence(weights)
    return found - 0.5 * away - 0.5 * wider


def _likeliest(
    rival: Rival, counts: Array, independent: Array, weights: Array
) -> tuple[Array, Array, Array]:
    """Squares of the runs (d, r), and curvature and change over [unknowns; residual] there.

    Each run counts as what it leaves does (`log_predictive`).
    """
    grams = np.swapaxes(rival.triangles, 1, 2) @ rival.triangles
    prior = rival.prior.T @ rival.prior
    squares = np.broadcast_to(grams[:, -1, -1], weights.shape)
    curves, change = np.zeros(0), np.zeros(0)
    for _ in range(ROUNDS):
        inflation = 1.0 + np.maximum(squares - counts, 0.0) / independent
        curves = np.tensordot(weights / inflation, grams, 1) + prior
        step = -np.linalg.solve(curves[:, :-1, :-1], curves[:, :-1, -1:])[..., 0]
        change = np.column_stack([step, np.ones(len(step))])
        squares = np.einsum("da,rab,db->dr", change, grams, change, optimize=True)
    return squares, curves, change


def numbers_taken(rival: Rival, counts: Array, independent: Array) -> float:
    """How many numbers of the runs a model's unknowns have taken up: those that data determine.

    Args:
        rival: the model.
        counts: how many numbers each run measured, (r,).
        independent: how many of those that it leaves move independently, (r,).

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.5: the effective number of
        parameters.
    """
    _, curves, _ = _likeliest(rival, counts, independent, np.ones((1, len(counts))))
    kept = np.linalg.solve(curves[0, :-1, :-1], (rival.prior.T @ rival.prior)[:-1, :-1])
    return float(len(kept) - np.trace(kept))


def model_probabilities(rivals: Sequence[Rival], counts: Array, independent: Array) -> Array:
    """Probability of each of some models, of which one is right, (m,).

    Args:
        rivals: the models.
        counts: how many numbers each run measured, (r,).
        independent: how many of those that the first model leaves move independently, (r,).

    Source:
        Huggins, Miller 2023, Reproducible model selection using bagged posteriors.
    """
    runs = len(counts)
    # A model that leaves less knows the inertia better and is charged for that: the numbers that
    # tell the inertia have to count as well then.
    independent = independent + numbers_taken(rivals[0], counts, independent) / runs
    weights = runs * np.random.default_rng(SEED).dirichlet(np.ones(runs), DRAWS)
    odds = np.log(CHANCE_OF_EFFECT / (1.0 - CHANCE_OF_EFFECT))
    logs = np.array(
        [
            log_evidence(one, counts, independent, weights) + odds * one.effects - one.tries
            for one in rivals
        ]
    )
    shares = np.exp(logs - logs.max(axis=0))
    return (shares / shares.sum(axis=0)).mean(axis=1)
