"""Probabilities of rival models from how each predicts runs that it was not fitted to.

Pseudo-Bayesian model averaging with the Bayesian bootstrap over whole runs (Yao, Vehtari, Simpson,
Gelman 2018): the log predictive densities of the left-out runs are summed under random weights of
the runs, and the models' shares averaged. A lead that one run gives counts for one run alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.cdpr.robot import Array

DRAWS = 2000
SEED = 20201
# One effect in thirty of a catalogue of twenty is there: something is missing every second time.
CHANCE_OF_EFFECT = 1.0 / 30.0


def log_predictive(squares: Array, counts: Array, independent: Array) -> Array:
    """Log density of left-out runs whose noise is white beside a discrepancy of unknown size, (r,).

    What a run's whitened squares exceed their number is a discrepancy that holds `independent`
    numbers, with whatever variance makes it likeliest. At the noise this is minus half the squares;
    far above it a factor counts, since nobody knows the size of what is missing.

    Args:
        squares: of each run's whitened errors of prediction, (r,).
        counts: how many numbers each run measured, (r,).
        independent: how many of them the discrepancy moves independently, (r,).
    """
    excess = np.asarray(squares) - counts
    above = -0.5 * independent * np.log1p(np.maximum(excess, 0.0) / independent)
    return above + 0.5 * np.maximum(-excess, 0.0)


def model_weights(densities: Sequence[Array], effects: Sequence[int]) -> Array:
    """Probability of each model, (m,).

    Args:
        densities: log predictive densities of the runs under each model, (r,) each.
        effects: how many effects each model has: each is improbable beforehand.

    Source:
        Yao, Vehtari, Simpson, Gelman 2018, Using stacking to average Bayesian predictive
        distributions.
    """
    table = np.array(densities, dtype=np.float64)
    runs = table.shape[1]
    odds = np.log(CHANCE_OF_EFFECT / (1.0 - CHANCE_OF_EFFECT))
    shares = np.random.default_rng(SEED).dirichlet(np.ones(runs), DRAWS)
    logs = runs * shares @ table.T + odds * np.asarray(effects)
    weights = np.exp(logs - logs.max(axis=1, keepdims=True))
    return (weights / weights.sum(axis=1, keepdims=True)).mean(axis=0)
