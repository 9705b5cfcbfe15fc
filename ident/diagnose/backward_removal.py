"""Backward removal: an effect that a later one makes superfluous leaves the model again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.ident.diagnose.decision import ACCEPTED, CONFOUNDED_DIFFERENCE, included, left_out
from freeswing.ident.diagnose.refit import Refit

# Of the BIC without an effect to second order, below which leaving it out is worth a fit: beyond,
# the evidence for it is very strong (Kass, Raftery 1995, Bayes Factors, sec. 3.2).
LARGEST_RISE = 10.0


def superfluous(current: Refit, kept: Sequence[str]) -> str:
    """The effect whose values differ least from doing nothing, by its covariance; or "".

    Args:
        current: the fit with all effects.
        kept: effects that may not leave: the one that came last and its group. Nor may a geometry
            that the lengths along the runs have settled.
    """
    count = float(current.evidence.counts.sum())
    rises = {}
    for name in current.effects:
        if name in kept:
            continue
        where = current.values_of(name)
        parameters = current.fit.model.parameters[where]
        settled = any(parameter.source for parameter in parameters)
        if settled or any(parameter.per_run for parameter in parameters):
            continue
        estimated = current.fit.unknowns.block(name).mask
        tested = [k for k, p in enumerate(parameters) if p.amplitude and estimated[k]]
        away = current.fit.values[where] - [parameter.start for parameter in parameters]
        covariance = current.fit.covariance_of(name)[np.ix_(tested, tested)]
        rise = float(away[tested] @ np.linalg.solve(covariance, away[tested]))
        rises[name] = rise - estimated.sum() * np.log(count)
    if not rises:
        return ""
    least = min(rises, key=lambda name: rises[name])
    return least if rises[least] < LARGEST_RISE else ""


def is_no_worse(fewer: Refit, more: Refit, name: str, noise_scales: np.ndarray) -> bool:
    """Whether a fit without an effect is as good as the one with it, its unknowns counted."""
    by_held_out = 2.0 * float(left_out(fewer, noise_scales).gains(more.score.held_out).sum())
    by_evidence = included(fewer, more, name, noise_scales)
    return by_evidence <= ACCEPTED and by_held_out < CONFOUNDED_DIFFERENCE
