"""Geometry that cable lengths have settled, kept from dynamics that are still wrong.

Constant lengths hold whatever forces act. Where the dynamics still miss something, a joint fit
bends the geometry to make up for it, far more surely than lengths know it: on the recordings of
docs/bologna-2020.md a point moved by 5 mm towards where it is not. There the geometry stays what
lengths say, and what they leave open of it widens everything else: a cut in the flow of information
(Plummer 2015, "Cuts in Bayesian graphical models").
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.known_values import prior_whitener
from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.refit import SEARCHED, Refit, colour_of, rescored
from freeswing.ident.likelihood.blocks import with_effect_values
from freeswing.ident.likelihood.fit import fit


def settled_places(model: Model) -> np.ndarray:
    """Which of the model's values lengths have settled, places among them, (g,)."""
    own = [p for name in model.effects for p in effect_named(name).parameters(model.robot)]
    pairs = zip(model.parameters, own, strict=True)
    told = [k for k, (known, p) in enumerate(pairs) if (known.low, known.high) != (p.low, p.high)]
    return np.array(told, dtype=np.int64)


def cut(last: Refit, noise_scales: Array) -> Refit:
    """A fit again, with what lengths have settled held at what they say.

    Args:
        last: the fit, whose samples and other unknowns it goes on from.
        noise_scales: of metres and radians, (2,).
    """
    found, model, values = last.fit, last.fit.model, last.fit.values.copy()
    settled = np.zeros(len(values), dtype=bool)
    settled[settled_places(model)] = True
    values[settled] = model.start_values[settled]
    unknowns = with_effect_values(found.unknowns, model, values)
    for name in model.effects:
        block = unknowns.block(name)
        free = block.mask & ~settled[model.place_of(name)]
        unknowns = unknowns.exchanged(replace(block, estimated=free))
    exact = fit(found.swings, unknowns, SEARCHED)
    geometry = exact.inertia.size + settled_places(model)
    return rescored(exact, noise_scales, colour_of(exact, noise_scales), geometry)


def with_settled(covariance: Array, held: Refit) -> Array:
    """A covariance of the shared unknowns with that of the held geometry, and what it does.

    Args:
        covariance: of the others, the geometry being exact, (p, p).
        held: the fit with the geometry held.

    Source:
        Bierman 1977, Factorization Methods for Discrete Sequential Estimation, ch. 8.
    """
    model, places = held.fit.model, settled_places(held.fit.model)
    whitener = prior_whitener(model)
    known = np.linalg.inv(whitener.T @ whitener)[np.ix_(places, places)]
    evidence = held.evidence
    rows = np.vstack([*evidence.triangles, evidence.prior_rows])[:, :-1]
    free, geometry = np.flatnonzero(held.fit.free), held.fit.inertia.size + places
    others = evidence.columns(free)[:-1]
    moved = -np.linalg.lstsq(rows[:, others], rows[:, geometry], rcond=None)[0][: len(free)]
    together = np.concatenate([free, geometry])
    slopes = np.vstack([moved, np.eye(len(places))])
    wider = covariance.copy()
    wider[np.ix_(together, together)] += slopes @ known @ slopes.T
    return wider
