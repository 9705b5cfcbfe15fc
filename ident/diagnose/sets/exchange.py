"""A place that was found, held against sets of places that may be wrong instead.

Those that linear evidence does not exclude are fitted in earnest. Of those about as probable as any
the one with the fewest numbers leads; the others are told with it, and what they make of the
inertia belongs to its deviations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.decision import (
    CLEARLY_LIKELIER,
    CONFOUNDED_DIFFERENCE,
    RIVAL,
    Candidate,
    Decision,
    left_out,
)
from freeswing.ident.diagnose.model_probabilities import model_probabilities
from freeswing.ident.diagnose.refit import Refit, colour_of, plausible
from freeswing.ident.diagnose.sets.fits_as_rivals import rival_of
from freeswing.ident.diagnose.sets.sets_of_places import (
    LinearSets,
    count_of,
    is_place,
    likely_sets,
    linear_sets,
)
from freeswing.ident.diagnose.sets.ways import Exchange, Places, Way, is_held_by
from freeswing.ident.diagnose.spectrum import independent_numbers
from freeswing.ident.diagnose.variants import effect_of

Fits = Callable[[Sequence[tuple[Places, dict[str, Array]]]], dict[Places, Refit]]


def exchange(
    before: Refit, found: Refit, key: str, left: Sequence[str], noise_scales: Array, fits: Fits
) -> Exchange | None:
    """What stands for a place that was found; None: that place, and nothing may instead.

    Args:
        before: the fit without it.
        found: the fit with it.
        key: the place's.
        left: keys of all that is not in the model before.
        noise_scales: of metres and radians, (2,).
        fits: makes the fits of sets from where they begin; those that cannot be followed are not
            among them.
    """
    if not is_place(effect_of(key)):
        return None
    others = [one for one in left if is_place(effect_of(one))]
    sets = linear_sets(found, key, others, noise_scales, colour_of(found.fit, noise_scales))
    made = fits([(places, sets.answer(places)) for places in likely_sets(sets, key)])
    known = {(key,): found} | {
        places: one
        for places, one in made.items()
        if not any(plausible(one, place) for place in places)
        and _predicts_as_well(before, one, found, noise_scales)
    }
    chances = _chances(known, found, noise_scales)
    leader = leading(chances, {places: count_of(sets.model.robot, places) for places in known})
    ways = tuple(
        Way(places, chances[places], known[places])
        for places in sorted(known, key=lambda one: -chances[one])
        if places != leader and chances[places] > RIVAL
    )
    if leader == (key,):
        return Exchange(leader, chances[leader], (found,), ways) if ways else None
    ordered = _strongest_first(sets, leader)
    parts = [ordered[:count] for count in range(1, len(ordered))]
    steps = fits([(part, sets.answer(part)) for part in parts])
    # What a part of the leader leaves is shown alone: where it cannot be followed, nothing is.
    chain = [steps.get(part, before) for part in parts]
    return Exchange(ordered, chances[leader], (*chain, known[leader]), ways)


def leading(chances: Mapping[Places, float], numbers: Mapping[Places, int]) -> Places:
    """Of the sets about as probable as any, the one of the fewest numbers, then the likeliest.

    Args:
        chances: probability of each set.
        numbers: how many each estimates.
    """
    likely = CLEARLY_LIKELIER * max(chances.values())
    of_these = [places for places in chances if chances[places] >= likely]
    return min(of_these, key=lambda places: (numbers[places], -chances[places]))


def _predicts_as_well(before: Refit, one: Refit, found: Refit, noise_scales: Array) -> bool:
    """Whether runs left out are predicted as well as by the place that was found."""
    runs = left_out(before, noise_scales)
    lost = float((runs.gains(found.score) - runs.gains(one.score)).sum())
    return 2.0 * lost < CONFOUNDED_DIFFERENCE


def _chances(
    known: Mapping[Places, Refit], found: Refit, noise_scales: Array
) -> dict[Places, float]:
    """Probability of each set, of which one is what is wrong."""
    independent = independent_numbers(found.fit, noise_scales)
    rivals = [rival_of(one, *places) for places, one in known.items()]
    shares = model_probabilities(rivals, found.evidence.counts, independent)
    return dict(zip(known, shares.tolist(), strict=True))


def _strongest_first(sets: LinearSets, places: Places) -> Places:
    return tuple(sorted(places, key=lambda key: -sets.log_evidence((key,))))


def decisions(decision: Decision, told: Exchange) -> list[Decision]:
    """What is said of a leader's places, one after another, in the place of a decision.

    Args:
        decision: that found the place.
        told: what stands for it.
    """
    names = {effect_of(key) for key in told.leader}
    last = effect_of(decision.key)
    others = {effect_of(key) for way in told.ways for key in way.places} - names
    # What left-out runs could not tell from the place that was found stays beside the first.
    first = tuple(n for n in decision.group if n not in names and n != last)
    rivals = {
        key: tuple(dict.fromkeys((*(first if not k else ()), *told.instead_of(key))))
        for k, key in enumerate(told.leader)
    }
    said = [_word(decision, told, key, rivals[key]) for key in told.leader]
    words = [said[0]]
    for one in decision.candidates:
        if one.effect in others:
            beside = tuple(effect_of(key) for key in told.leader)
            one = replace(one, verdict="confounded", confounded_with=beside, reason=_or(told))
        elif one.effect == last and last not in names:
            one = replace(one, verdict="rejected", confounded_with=(), reason=_instead(told))
        words += [one] if one.effect != said[0].effect else []
    found = [
        Decision(
            (word,) if k else tuple(words),
            fit,
            key,
            (effect_of(key), *rivals[key]),
            instead=tuple(n for n in rivals[key] if n in names),
        )
        for k, (key, fit, word) in enumerate(zip(told.leader, told.fits, said, strict=True))
    ]
    likeliest = told.ways[0].fit if told.ways else decision.rival
    found[-1] = replace(found[-1], rival=likeliest, exchange=told)
    return found


def sentence(told: Exchange) -> str:
    """What is left open, for a reader; empty where nothing is."""
    if not told.ways:
        return ""
    if told.leader:
        return (
            f"{_or(told)}: the first stands in the model, and the deviations of the inertia hold "
            "what the others would make of it"
        )
    ways = ", ".join(f"{_said(way.places)} ({100 * way.probability:.0f} %)" for way in told.ways)
    return (
        f"not sure enough to be named, or too little of what is left: {ways}; the deviations of "
        "the inertia hold what that would make of it, by its probability"
    )


def _word(decision: Decision, told: Exchange, key: str, others: tuple[str, ...]) -> Candidate:
    """The verdict on one place of a leader; `others` may be wrong instead of it."""
    known = next(one for one in decision.candidates if one.effect == effect_of(key))
    if told.leader == (decision.key,) and not told.instead_of(key):
        return known
    chance = told.probability + sum(w.probability for w in told.ways if is_held_by(key, w.places))
    return replace(
        known,
        verdict="confounded" if others else "accepted",
        confounded_with=others,
        reason=_or(told) if told.ways else _instead(told),
        probability=chance,
    )


def _or(told: Exchange) -> str:
    ways = [(told.leader, told.probability), *((w.places, w.probability) for w in told.ways)]
    either = " or ".join(f"{_said(places)} ({100 * chance:.0f} %)" for places, chance in ways)
    return f"these runs cannot tell {either}"


def _instead(told: Exchange) -> str:
    return f"{_said(told.leader)} explains these runs with fewer numbers or more surely"


def _said(places: Places) -> str:
    return " with ".join(key.replace(":", " ") for key in places)
