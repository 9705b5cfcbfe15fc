"""What is known of a model's values beforehand, a joint Gaussian; models with other effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from freeswing.cdpr.model.equations import IntArray, Model, build_model
from freeswing.cdpr.robot import Array


def prior_whitener(model: Model) -> Array:
    """Turns distances from `start_values` into independent ones of unit deviation, (k, k).

    Source:
        Golub, Van Loan 2013, Matrix Computations, sec. 4.2: the Cholesky factor; Bishop
        2006, Pattern Recognition and Machine Learning, sec. 2.3.
    """
    stds = np.array([parameter.prior_std for parameter in model.parameters])
    return whitener(stds, model.correlations)


def whitener(stds: Array, correlations: Array | None) -> Array:
    """Turns distances from means into independent ones of unit deviation, (k, k).

    Args:
        stds: infinite where nothing is known, (k,).
        correlations: (k, k); None: independent.

    Source:
        Golub, Van Loan 2013, Matrix Computations, sec. 4.2: the Cholesky factor.
    """
    scaled = np.diag(1.0 / stds)
    if correlations is None:
        return scaled
    return np.linalg.solve(np.linalg.cholesky(correlations), scaled)


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


def with_effects(model: Model, names: Sequence[str]) -> Model:
    """A model with further effects; what is known of those that it has stays known."""
    more = build_model(model.robot, (*model.effects, *names))
    known = model.parameters
    parameters = (*known, *more.parameters[len(known) :])
    together = model.correlations
    if together is not None:
        together = np.eye(len(parameters))
        together[: len(known), : len(known)] = model.correlations
    return replace(more, parameters=parameters, correlations=together)


def without_effect(model: Model, name: str) -> Model:
    """A model without one of its effects; what is known of the others stays known."""
    kept = np.ones(len(model.parameters), dtype=bool)
    kept[model.place_of(name)] = False
    fewer = build_model(model.robot, tuple(other for other in model.effects if other != name))
    parameters = tuple(one for one, stays in zip(model.parameters, kept, strict=True) if stays)
    together = model.correlations
    if together is not None:
        together = together[np.ix_(kept, kept)]
    return replace(fewer, parameters=parameters, correlations=together)
