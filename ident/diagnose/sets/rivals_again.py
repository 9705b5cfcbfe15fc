"""Groups of effects that a round could not tell apart, asked again beside all that came later.

While others are missing a tether leaves as little as a tilt, an anchor as little as stretching
cables. Once nothing else is missing each can be held against the one that stands for the group.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.backward_removal import turned
from freeswing.ident.diagnose.decision import RIVAL, Candidate, Decision, decided, left_out
from freeswing.ident.diagnose.refit import Refit, colour_of, exchanged, without
from freeswing.ident.diagnose.variants import effect_of


def asked_again(
    decisions: Sequence[Decision], last: Refit, noise_scales: Array
) -> tuple[list[Decision], Refit]:
    """Decisions without rivals that are none beside what was accepted later, and the last fit.

    Each rival takes the leader's place in the last fit, from the values of its round, and the
    rules of a round are asked again. One of the group that leads there stands in the last fit
    instead. Who has at most 0.05 of the probability then, and predicts no run left out better than
    the leader, is no rival; who cannot be followed stays one.

    Args:
        decisions: of the rounds that have a winner.
        last: the last fit, beside which nothing that follows the motion is missing.
        noise_scales: of metres and radians, (2,).
    """
    told = list(decisions)
    for k, one in enumerate(told[:-1]):
        others = {effect_of(other.key) for other in told if other is not one}
        told[k], last = _held_against(one, others, last, noise_scales)
    return told, last


def _held_against(
    decision: Decision, known: set[str], last: Refit, noise_scales: Array
) -> tuple[Decision, Refit]:
    """One decision asked again, and the last fit; `known` are effects that others have found."""
    tried = {decision.key: last}
    for key, fit in decision.others.items():
        name = effect_of(key)
        if name in known or name in last.effects:
            continue
        values = {name: fit.fit.values[fit.values_of(name)]}
        with suppress(ValueError):  # stays a rival
            tried[key] = exchanged(last.fit, decision.key, (key,), values, noise_scales)
    if len(tried) == 1:
        return decision, last
    fewer = without(last.fit, effect_of(decision.key), noise_scales)
    again = decided(fewer, {}, tried, True, colour_of(fewer.fit, noise_scales), noise_scales)
    if not again.key:
        return decision, last
    if again.key != decision.key:
        decision = turned(decision, again.key, decision.others[again.key])
    runs = left_out(fewer, noise_scales)
    gains = {key: float(runs.gains(one.score).sum()) for key, one in tried.items()}
    chances = {one.effect: one.probability or 0.0 for one in again.candidates}
    out = {
        effect_of(key)
        for key in tried
        if chances[effect_of(key)] <= RIVAL and gains[key] <= gains[again.key]
    }
    return _parted(decision, out - {effect_of(again.key)}, chances), tried[again.key]


def _parted(decision: Decision, out: set[str], chances: dict[str, float]) -> Decision:
    """A decision without those of its group that are out, with what was said of them since."""
    group = tuple(name for name in decision.group if name not in out)
    others = {key: fit for key, fit in decision.others.items() if effect_of(key) in group}
    likeliest = max(others, key=lambda key: chances.get(effect_of(key), 0.0), default="")
    return replace(
        decision,
        candidates=tuple(_word(one, group, out, chances) for one in decision.candidates),
        group=group,
        rival=others.get(likeliest),
        others=others,
    )


def _word(
    one: Candidate, group: tuple[str, ...], out: set[str], chances: dict[str, float]
) -> Candidate:
    """What is said of an effect, by the last word on its group."""
    chance = chances.get(one.effect, one.probability)
    if one.effect in out:
        why = f"as good as {group[0]} at first, not beside all that was found (chance {chance:.2g})"
        return replace(one, verdict="rejected", confounded_with=(), reason=why, probability=chance)
    if one.effect not in group:
        return one
    beside = tuple(name for name in group if name != one.effect)
    if beside or not out:
        reason = f"these runs cannot tell it from {', '.join(beside)}" if beside else one.reason
        return replace(one, confounded_with=beside, reason=reason, probability=chance)
    reason = f"told from {', '.join(sorted(out))} by all that was found since"
    return replace(one, verdict="accepted", confounded_with=(), reason=reason, probability=chance)
