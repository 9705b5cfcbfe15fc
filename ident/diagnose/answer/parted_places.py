"""Places that cable lengths cannot tell apart, where the motions can.

Lengths say that an anchor or an attachment is off, by halves; both stand in the model. Once nothing
else is missing the motions know each ten times better, and all but one may be nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.answer.deviations import chance_of_nothing
from freeswing.ident.diagnose.answer.taken_back import unseen
from freeswing.ident.diagnose.backward_removal import is_no_worse
from freeswing.ident.diagnose.decision import ACCEPTED, Candidate, Decision
from freeswing.ident.diagnose.refit import Refit, without
from freeswing.ident.diagnose.search import Round
from freeswing.ident.diagnose.variants import effect_of
from freeswing.ident.likelihood.fit_swings import LikelihoodFit


def parted(
    accepted: Sequence[Round], last: Refit, final: LikelihoodFit, spread: Array, noise_scales: Array
) -> list[Round]:
    """The rounds of an answer, each group of places told as the one that the motions say is off.

    The others stay in the model, and widen it, but are not told.

    Args:
        accepted: rounds of the search that count.
        last: its last fit, whose geometry follows lengths and motions.
        final: that fit as it is told.
        spread: covariance of its shared unknowns as it is told, (p, p).
        noise_scales: of metres and radians, (2,).
    """
    found = []
    for one in accepted:
        place = ""
        if one.by_lengths and len(one.decision.group) > 1:
            place = _one_off(one.decision.group, last, final, spread, noise_scales)
        found.append(replace(one, decision=_told_as(place, one.decision)) if place else one)
    return found


def shown(accepted: Sequence[Round], final: LikelihoodFit, spread: Array) -> list[Round]:
    """The rounds of an answer, without geometry by lengths that is nothing as it is told.

    Where what is left in the residuals widens it to that: it stays in the model and widens all
    else, but it is not told, beside something that is.

    Args:
        accepted: rounds of the search that count.
        final: the last fit as it is told.
        spread: covariance of its shared unknowns as it is told, (p, p).
    """
    names = [name for name, _ in unseen(accepted, final, spread)]
    nothing = [one.by_lengths and effect_of(one.decision.key) in names for one in accepted]
    if all(nothing):
        return list(accepted)
    return [
        replace(one, decision=Decision(tuple(map(_unshown, one.decision.candidates))))
        if is_nothing
        else one
        for one, is_nothing in zip(accepted, nothing, strict=True)
    ]


def retold(
    rounds: Sequence[Round], accepted: Sequence[Round], told: Sequence[Round]
) -> tuple[list[Round], list[Round]]:
    """All rounds with those that count as they are told, and of these the ones that name one.

    Args:
        rounds: of the search.
        accepted: those that count.
        told: each of these as it is told.
    """
    instead = dict(zip(map(id, accepted), told, strict=True))
    stand = [one for one in told if one.decision.key]
    return [instead.get(id(one), one) for one in rounds], stand


def _unshown(one: Candidate) -> Candidate:
    why = "lengths say so; beside all that is told its values are nothing within their deviations"
    return replace(one, verdict="rejected", confounded_with=(), reason=why)


def _one_off(
    group: Sequence[str], last: Refit, final: LikelihoodFit, spread: Array, noise_scales: Array
) -> str:
    """The one place of a group that is off, whatever the others are; or "".

    Its values alone are not nothing, and it alone is what the model is worse without.
    """
    if not set(group) <= set(final.model.effects):
        return ""
    off = [n for n in group if chance_of_nothing(final, spread, n) < 1.0 - ACCEPTED]
    if len(off) != 1:
        return ""
    needed = [
        name
        for name in group
        if not is_no_worse(without(last.fit, name, noise_scales), last, name, noise_scales)
    ]
    return off[0] if needed == off else ""


def _told_as(place: str, decision: Decision) -> Decision:
    """A decision of lengths with one of its places alone."""
    words = [_word(one, place) for one in decision.candidates]
    words.sort(key=lambda one: one.effect != place)
    return replace(decision, candidates=tuple(words), key=place, group=(place,))


def _word(one: Candidate, place: str) -> Candidate:
    if one.effect == place:
        reason = f"{one.reason}; of these the motions say that it is this one"
        return replace(one, verdict="accepted", confounded_with=(), reason=reason)
    why = f"lengths cannot tell it from {place}, the motions do: it is nothing beside that"
    return replace(one, verdict="rejected", confounded_with=(), reason=why)
