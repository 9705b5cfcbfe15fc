"""What became of every effect once the search has ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from freeswing.ident.diagnose.decision import Candidate
from freeswing.ident.diagnose.search import Round
from freeswing.ident.diagnose.variants import effect_of


def rivals_of(accepted: Sequence[Round]) -> dict[str, tuple[str, ...]]:
    """For each effect that was accepted, its group without what was accepted beside it."""
    winners = {effect_of(one.decision.key) for one in accepted}
    found = {}
    for one in accepted:
        name, told = effect_of(one.decision.key), one.decision
        found[name] = tuple(
            n for n in told.group if n == name or n not in winners or n in told.instead
        )
    return found


def final_verdicts(
    rounds: Sequence[Round], final: tuple[str, ...], barred: dict[str, str], names: tuple[str, ...]
) -> tuple[Candidate, ...]:
    """Each effect's verdict in the round that accepted it, else in the last that looked at it.

    Effects that rounds have found beside one another are no longer rivals.

    Args:
        rounds: of the search.
        final: effects of the final model, none where nothing is accepted.
        barred: effects that the data cannot show, and why.
        names: that were to be considered.
    """
    words: dict[str, Candidate] = {}
    winners = {effect_of(one.decision.key) for one in rounds if one.decision.key}
    together = winners.intersection(final)
    for one in rounds:
        stays = any(name in final for name in one.decision.group)
        for candidate in one.decision.candidates:
            if candidate.verdict != "rejected" and not stays:
                candidate = replace(candidate, verdict="rejected", confounded_with=())
            known = words.get(candidate.effect)
            if stays and candidate.effect in together:
                candidate = _beside(candidate, together.difference(one.decision.instead))
            first = candidate.effect == effect_of(one.decision.key)
            if known is None or known.verdict == "rejected" or (stays and first):
                words[candidate.effect] = candidate
        for name in one.removed:
            why = f"superfluous since {effect_of(one.decision.key)} is in the model: removed again"
            words[name] = replace(words[name], verdict="rejected", confounded_with=(), reason=why)
    for name, why in barred.items():
        if name in names:
            words[name] = Candidate(name, "not_identifiable", 0.0, 0.0, (), why)
    order = {"accepted": 0, "confounded": 1, "rejected": 2, "not_identifiable": 3}
    return tuple(sorted(words.values(), key=lambda c: (order[c.verdict], c.delta_bic)))


def _beside(candidate: Candidate, together: set[str]) -> Candidate:
    """A verdict without rivals that stand in the model beside it."""
    others = tuple(name for name in candidate.confounded_with if name not in together)
    if others == candidate.confounded_with:
        return candidate
    found = ", ".join(name for name in candidate.confounded_with if name in together)
    reason = f"in the model beside {found}"
    verdict = candidate.verdict
    if others:
        reason += f"; these runs cannot tell it from {', '.join(others)}"
    else:
        verdict = "accepted"
    return replace(candidate, verdict=verdict, confounded_with=others, reason=reason)
