"""What is known beforehand of a model's values, as a joint Gaussian."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from freeswing.cdpr.model.equations import IntArray, Model
from freeswing.cdpr.robot import Array


def prior_whitener(model: Model) -> Array:
    """Turns distances from `start_values` into independent ones of unit deviation, (k, k).

    Source:
        Golub, Van Loan 2013, Matrix Computations, sec. 4.2: the Cholesky factor; Bishop
        2006, Pattern Recognition and Machine Learning, sec. 2.3.
    """
    scaled = np.diag([1.0 / parameter.prior_std for parameter in model.parameters])
    if model.correlations is None:
        return scaled
    return np.linalg.solve(np.linalg.cholesky(model.correlations), scaled)


def with_known(
    model: Model, places: IntArray, values: Array, covariance: Array, source: str
) -> Model:
    """The model with some of its values known as a joint Gaussian.

    Args:
        model: with the effect that they belong to.
        places: among its values, (q,).
        values: their means, (q,).
        covariance: theirs, (q, q).
        source: who says so, a few words for people.
    """
    stds = np.sqrt(np.diag(covariance))
    parameters = list(model.parameters)
    for place, value, std in zip(places, values, stds, strict=True):
        parameters[place] = parameters[place].known(float(value), float(std), source)
    count = len(parameters)
    together = np.eye(count) if model.correlations is None else model.correlations.copy()
    together[places] = together[:, places] = 0.0
    together[np.ix_(places, places)] = covariance / np.outer(stds, stds)
    return replace(model, parameters=tuple(parameters), correlations=together)
