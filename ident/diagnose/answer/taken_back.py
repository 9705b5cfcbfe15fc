"""Effects of an answer that their own values, as they would be told, do not show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.answer.deviations import chance_of_nothing
from freeswing.ident.diagnose.answer.entries import claims
from freeswing.ident.diagnose.answer.unmet_validation import is_shown
from freeswing.ident.diagnose.backward_removal import is_no_worse
from freeswing.ident.diagnose.decision import ACCEPTED, lacks_little
from freeswing.ident.diagnose.heldout import HeldOut
from freeswing.ident.diagnose.refit import Refit, without
from freeswing.ident.diagnose.search import Round
from freeswing.ident.diagnose.variants import effect_of
from freeswing.ident.likelihood.fit_swings import LikelihoodFit


class TakenBack(NamedTuple):
    """An answer without an effect: the fit that is left, its rounds, and a sentence on why."""

    last: Refit
    accepted: list[Round]
    note: str


def taken_back(
    accepted: list[Round], last: Refit, final: LikelihoodFit, spread: Array, noise_scales: Array
) -> TakenBack | None:
    """The answer without one effect that would be told with values of nothing; None: all are seen.

    The effect that came last goes with its round. An earlier one may look like nothing because
    another that stands beside it says the same: it goes only where the model is as good without
    it, by its evidence and on runs left out.

    Args:
        accepted: rounds of the search that count.
        last: its last fit.
        final: that fit as it would be told.
        spread: covariance of its shared unknowns as it would be told, (p, p).
        noise_scales: of metres and radians, (2,).
    """
    for name, chance in unseen(accepted, final, spread):
        rounds = [one for one in accepted if effect_of(one.decision.key) != name]
        why = f"values that are nothing within their deviations (chance {chance:.2f})"
        if effect_of(accepted[-1].decision.key) == name:
            note = f"{name} would be told with {why}: not accepted"
            before = _before_last(accepted, last, name, noise_scales)
            return TakenBack(before, accepted[:-1], note)
        fewer = without(last.fit, name, noise_scales)
        if is_no_worse(fewer, last, name, noise_scales):
            beside = ", ".join(dict.fromkeys(effect_of(one.decision.key) for one in rounds))
            return TakenBack(fewer, rounds, f"{name} has {why} beside {beside}: taken back")
    return None


def unshown(
    accepted: Sequence[Round], last: Refit, ladder: Sequence[HeldOut], noise_scales: Array
) -> TakenBack | None:
    """The answer without an effect found at the noise that validation runs do not show.

    There the fitted runs' evidence alone speaks for it: beside friction on pulleys, whose shape
    differs a little from reality, a force at 11 Hz of 0.9997 was told that was not there.

    Args:
        accepted: rounds of the search that count.
        last: its last fit.
        ladder: validation runs before them and after each.
        noise_scales: of metres and radians, (2,).
    """
    if not accepted or accepted[-1].by_lengths or not lacks_little(accepted[-1].before):
        return None
    if is_shown(ladder[-2], ladder[-1]):
        return None
    name = effect_of(accepted[-1].decision.key)
    note = f"{name} was found at the noise, and validation runs are not predicted better with it"
    before = _before_last(accepted, last, name, noise_scales)
    return TakenBack(before, list(accepted[:-1]), f"{note}: not accepted")


def _before_last(accepted: Sequence[Round], last: Refit, name: str, noise_scales: Array) -> Refit:
    """The fit that stood before the last effect, without others that were taken back since."""
    before = accepted[-1].before
    known = {effect_of(one.decision.key) for one in accepted}
    known |= {name for one in accepted if one.by_lengths for name in one.decision.group}
    if known.issuperset(claims(before.effects)):
        return before
    return without(last.fit, name, noise_scales)


def unseen(
    accepted: Sequence[Round], final: LikelihoodFit, spread: Array
) -> list[tuple[str, float]]:
    """Effects of an answer whose values are nothing, with the chance of that.

    The one that came last comes first, then those that are likeliest nothing. Geometry that cable
    lengths have settled is asked as well, where forces were let to say how far it is off, but for
    places that lengths cannot tell apart: one of them may be nothing because another says the same.

    Args:
        accepted: rounds of the search that count.
        final: the last fit as it would be told.
        spread: covariance of its shared unknowns as it would be told, (p, p).
    """
    by_lengths = [one.decision.group for one in accepted if one.by_lengths]
    places = {name for group in by_lengths if len(group) > 1 for name in group}
    names = [effect_of(one.decision.key) for one in reversed(accepted)]
    asked = [n for n in dict.fromkeys(names) if n not in places and n in final.model.effects]
    chances = {name: chance_of_nothing(final, spread, name) for name in asked}
    doubted = [name for name in asked if chances[name] >= 1.0 - ACCEPTED]
    return [(n, chances[n]) for n in sorted(doubted, key=lambda n: (n != names[0], -chances[n]))]
