"""What leaves again: effects made superfluous by later ones, stand-ins, leaders of a group."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from freeswing.ident.diagnose.decision import (
    ACCEPTED,
    CONFOUNDED_DIFFERENCE,
    RIVAL,
    Decision,
    included,
    left_out,
)
from freeswing.ident.diagnose.refit import Refit, impossible_values, plausible
from freeswing.ident.diagnose.variants import effect_of

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
    by_held_out = 2.0 * float(left_out(fewer, noise_scales).gains(more.score).sum())
    by_evidence = included(fewer, more, name, noise_scales)
    return by_evidence <= ACCEPTED and by_held_out < CONFOUNDED_DIFFERENCE


def outdone(decision: Decision, tried: Mapping[str, Refit]) -> str:
    """Why what won a round stands in for something else: a sentence, or "".

    Where values that no such effect can have are what is missing with far more probability, nothing
    of the catalogue is: a drag that drives was answered by a force at 37 Hz of 3e-18.

    Args:
        decision: of the round.
        tried: what was fitted in it, by key.
    """
    chances, leader, why = _likeliest_refused(decision, tried, plausible)
    mine = sum(chances[name] for name in decision.group)
    if not leader or mine > RIVAL * (mine + chances[leader]):
        return ""
    better = f"{leader} with values that cannot be explains it better ({why})"
    return f"the nearest, not the cause: {better}"


def would_explain(decision: Decision, tried: Mapping[str, Refit]) -> str:
    """What would be the cause where nothing won, if its values could be: a sentence, or "".

    Args:
        decision: of the round.
        tried: what was fitted in it, by key.
    """
    chances, leader, why = _likeliest_refused(decision, tried, impossible_values)
    if not leader or chances[leader] < ACCEPTED:
        return ""
    return f"{leader} would explain it with values that cannot be ({why})"


def turned(decision: Decision, key: str, fit: Refit) -> Decision:
    """A decision led by another of its group.

    Args:
        decision: of a round that has a winner.
        key: of who leads instead.
        fit: with it.
    """
    first = effect_of(key)
    led = {} if decision.winner is None else {decision.key: decision.winner}
    return replace(
        decision,
        winner=fit,
        key=key,
        group=(first, *(name for name in decision.group if name != first)),
        rival=decision.winner,
        others=led | {name: one for name, one in decision.others.items() if name != key},
        ahead=None,
    )


def _likeliest_refused(
    decision: Decision,
    tried: Mapping[str, Refit],
    complaints: Callable[[Refit, str], list[str]],
) -> tuple[dict[str, float], str, str]:
    """Probabilities of a round; the likeliest effect that is complained of, and what is said."""
    chances = {one.effect: one.probability or 0.0 for one in decision.candidates}
    refused = {effect_of(key): complaints(one, key) for key, one in tried.items()}
    names = [n for n, said in refused.items() if said and n not in decision.group]
    leader = max(names, key=lambda name: chances[name], default="")
    return chances, leader, "; ".join(refused.get(leader, ()))
