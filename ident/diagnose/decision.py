"""Which candidates are worth fitting, and what held-out runs decide of those that were fitted."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.leave_one_out import Score
from freeswing.ident.diagnose.lengths.stated_lengths import lengths_off
from freeswing.ident.diagnose.lengths.wrong_places import WrongPlace
from freeswing.ident.diagnose.model_probabilities import LeftOut, model_probabilities
from freeswing.ident.diagnose.refit import Refit, plausible
from freeswing.ident.diagnose.sets.fits_as_rivals import rival_of
from freeswing.ident.diagnose.sets.ways import Exchange, Way
from freeswing.ident.diagnose.spectrum import independent_numbers
from freeswing.ident.diagnose.variants import effect_of, inside

# How many are fitted at a time beyond those that promise so near to the best, and what is not
# worth a fit.
REFITTED = 4
NEARLY_AS_GOOD = 0.5
LEAST_GAIN = 10.0
# The threshold for accepting: that an effect is there rather than nothing.
ACCEPTED = 0.95
# Left-out runs this much better than their noise lack nothing: chance alone leaves a few per cent,
# and what an effect takes there is a part of what cameras and markers share, not of the swing.
MOST_BELOW_NOISE = 0.1
# A cause helps wherever it shows; what trades small swings for large ones is a stand-in.
MOST_WORSE = 0.25
NO_WORSE = 0.01
NO_WORSE_OF_GAIN = 0.1
# A second effect must be worth its place: integrators, shapes of friction and points of
# application differ a little from reality, and 0.1 mm samples see it.
LEAST_GAIN_LATER = 0.25
# Left-out runs within this of the noise lack little that a fit would have to follow.
LEAST_EXCESS_LATER = 0.005
# What promises less than this of the excess to first order does not come to a quarter once fitted.
LEAST_PROMISE_LATER = 0.05
# What may well be it instead of the best: more probable than this, or behind by no more than e^6 in
# the likelihood of left-out runs. A gain that 15 % of the runs contradict is none.
RIVAL = 0.05
CONFOUNDED_DIFFERENCE = 12.0
# Of such a group none leads that is less probable than the likeliest by more than the factor that
# is worth a bare mention (Kass, Raftery 1995, Bayes Factors, sec. 3.2).
CLEARLY_LIKELIER = 1.0 / 3.0
LEAST_EXCESS = 0.005
CONTRADICTED = 0.15
# Effects whose best mixture explains less than this of the excess are the nearest, not the cause.
LEAST_SHARE_EXPLAINED = 0.75
# What is not the cause shows in the residuals, or in runs left out although each run by itself is
# followed well. Nor is a model that leaves so much asked how far all poses err together.
LARGEST_EXCESS_LEFT = 0.5


@dataclass(frozen=True, slots=True)
class Candidate:
    """What became of one effect.

    Attributes:
        effect: its name.
        verdict: accepted, rejected, confounded or not_identifiable.
        delta_bic: BIC with it less BIC without it, the residual's colour allowed for.
        held_out_gain: share of the held-out excess over the noise that it removes.
        confounded_with: effects that held-out runs cannot tell from it.
        reason: a sentence.
        probability: that it is what is missing, among those fitted and none of them; None where it
            was not fitted.
    """

    effect: str
    verdict: str
    delta_bic: float
    held_out_gain: float
    confounded_with: tuple[str, ...]
    reason: str
    probability: float | None = None


@dataclass(frozen=True, slots=True)
class Decision:
    """What became of the candidates of a round, who won, and who cannot be told from it.

    Attributes:
        candidates: one an effect.
        winner: the fit with the one that won, or None.
        key: the winner's, or "".
        group: effects that held-out runs cannot tell from it, its own among them.
        rival: the fit with the likeliest other effect of the group, or None.
        ahead: key of one of the group that left-out runs speak for far more, with its fit, or None.
        others: fits with the others of the group, by key.
        instead: those of the group that may be wrong instead by other parts than are in the model.
        exchange: what may be there instead of the winner, or although nothing won.
    """

    candidates: tuple[Candidate, ...]
    winner: Refit | None = None
    key: str = ""
    group: tuple[str, ...] = ()
    rival: Refit | None = None
    ahead: tuple[str, Refit] | None = None
    others: Mapping[str, Refit] = field(default_factory=dict)
    instead: tuple[str, ...] = ()
    exchange: Exchange | None = None


def by_lengths(place: WrongPlace, share: float) -> tuple[Candidate, ...]:
    """What cable lengths decide: the likeliest block accepted, those that replace it beside it.

    Args:
        place: a block or a group of blocks that is off.
        share: of the lengths' variance along the runs that all geometry explains.
    """
    names = tuple(dict.fromkeys(effect_of(key) for key in place.keys))
    told = []
    for name in names:
        chance = max(way.probability for way in place.ways if effect_of(way.key) == name)
        verdict = "confounded" if told else "accepted"
        others = tuple(other for other in names if other != name)
        chance = place.probability if len(names) == 1 else chance
        word = Candidate(name, verdict, place.delta_bic, share, others, str(place), chance)
        told.append(word)
    return tuple(told)


def promising(
    current: Refit,
    linear: dict[str, Score],
    colour: float,
    noise_scales: Array,
    tried: Collection[str] = (),
    later: bool = False,
) -> list[str]:
    """The next candidates worth fitting, those nearest to the linear best first.

    Left-out runs rank well what is well determined; a tether or an offset has more unknowns than
    a linear step settles beside a large residual, and shows in the likelihood first. At first all
    those that promise nearly as much as the best: beside a large residual the screen ranks true
    effects sixth, and a drag that was not fitted was answered by its neighbour. Once these were
    fitted, all that the screen does not exclude follow, a few at a time.

    Args:
        current: the fit without any.
        linear: what each makes of the linear evidence.
        colour: of the current residual.
        noise_scales: of metres and radians, (2,).
        tried: keys that were fitted.
        later: whether something was accepted before: a further effect must be worth its place.
    """
    runs = left_out(current, noise_scales)
    excess = max((current.score.cost - float(runs.counts.sum())) / colour, LEAST_GAIN)
    held_out = {n: 2.0 * float(runs.gains(one).sum()) for n, one in linear.items()}
    likelihood = {
        n: (current.score.cost - one.cost) / colour - penalty(current, n)
        for n, one in linear.items()
    }
    shares = {n: runs.share(one) for n, one in linear.items()}
    of_likelihood = {n: gain / excess for n, gain in likelihood.items()}
    chosen: list[str] = []
    for gains, promise in ((held_out, shares), (likelihood, of_likelihood)):
        ranked = _best_of_each(sorted(gains, key=lambda n: -gains[n]))
        least = NEARLY_AS_GOOD * promise[ranked[0]] if not tried else 0.0
        least = max(least, LEAST_PROMISE_LATER) if later else least
        worth = (n for n in ranked if promise[n] > least and gains[n] > LEAST_GAIN)
        further = [n for n in worth if n not in tried]
        chosen += [n for n in further[: REFITTED if tried else None] if n not in chosen]
    return chosen


def settles(decision: Decision, current: Refit, noise_scales: Array) -> bool:
    """Whether what won may be the cause: it explains the excess, or reaches the noise nearly.

    Else the nearest of those fitted may have won, and the others want fitting too.
    """
    if decision.winner is None:
        return False
    gain = left_out(current, noise_scales).share(decision.winner.score)
    return gain >= LEAST_SHARE_EXPLAINED or lacks_little(decision.winner)


def _best_of_each(ranked: list[str]) -> list[str]:
    """The first key of each effect."""
    first: dict[str, str] = {}
    for key in ranked:
        first.setdefault(effect_of(key), key)
    return list(first.values())


def decided(
    current: Refit,
    linear: dict[str, Score],
    tried: dict[str, Refit],
    later: bool,
    colour: float,
    noise_scales: Array,
) -> Decision:
    """The verdict of a round.

    Args:
        current: the fit without any of the candidates.
        linear: what each makes of the linear evidence.
        tried: those that were fitted.
        later: whether something was accepted before.
        colour: of the current residual.
        noise_scales: of metres and radians, (2,).
    """
    ranked = sorted(linear, key=lambda name: float(linear[name].held_out.sum()))
    runs = left_out(current, noise_scales)
    said = {n: _complaint(current, one, n, noise_scales, later) for n, one in tried.items()}
    complaints = {n: why for n, why in said.items() if why}
    passed = {n: one for n, one in tried.items() if n not in complaints}
    chances = probabilities(current, tried, noise_scales)
    key, group = _winner(passed, chances, current, runs)
    told = _best_of_each([key, *sorted(tried, key=lambda n: tried[n].held_out), *ranked])
    candidates = []
    for one in filter(None, told):
        known = tried.get(one)
        seen = known.score if known else linear[one]
        bic = delta_bic(current, seen, one, colour)
        gain = runs.share(seen)
        verdict, reason, others = _verdict(one, key, group, complaints, known, passed, gain)
        mine = [p for other, p in chances.items() if effect_of(other) == effect_of(one)]
        chance = sum(mine) if mine else None
        candidates.append(
            Candidate(effect_of(one), verdict, float(bic), gain, others, reason, chance)
        )
    keys = [n for n in passed if effect_of(n) in group and effect_of(n) != effect_of(key)]
    others, won = {n: passed[n] for n in keys}, passed.get(key)
    rival = others.get(max(keys, key=lambda n: chances[n], default=""))
    unsure = None if key else _unsure(current, tried, chances)
    ahead = _ahead(key, {key: won, **others} if won else {}, runs)
    words = tuple(candidates)
    return Decision(words, won, key, group, rival, ahead, others, exchange=unsure)


def _unsure(current: Refit, tried: dict[str, Refit], chances: dict[str, float]) -> Exchange | None:
    """What may be there though it was refused, the likeliest first: nothing impossible is."""
    likely = sorted((n for n in tried if chances[n] > RIVAL), key=lambda n: -chances[n])
    ways = [Way((n,), chances[n], tried[n]) for n in likely if not plausible(tried[n], n)]
    nothing = 1.0 - sum(chances.values())
    return Exchange((), nothing, (current,), tuple(ways)) if ways else None


def probabilities(current: Refit, tried: dict[str, Refit], noise_scales: Array) -> dict[str, float]:
    """Probability of each fitted candidate to be what is missing, by key.

    What remains to one is that of none of them.
    """
    counts = current.evidence.counts
    independent = independent_numbers(current.fit, noise_scales)
    rivals = [rival_of(current), *(rival_of(one, key) for key, one in tried.items())]
    weights = model_probabilities(rivals, counts, independent)
    return dict(zip(tried, weights[1:].tolist(), strict=True))


def included(fewer: Refit, more: Refit, key: str, noise_scales: Array) -> float:
    """Probability that what a fit has beside another is there, of these two alone."""
    return probabilities(fewer, {key: more}, noise_scales)[key]


def delta_bic(current: Refit, one: Score, key: str, colour: float) -> float:
    """BIC with a candidate less BIC without it, the residual's colour allowed for."""
    return (one.cost - current.score.cost) / colour + penalty(current, key)


def penalty(current: Refit, key: str) -> float:
    """What a candidate's unknowns cost: log n each, and 2 (AIC) for those that each run has.

    A fan's phase is predicted in no other run: it is no claim about the robot.
    """
    shared, own = unknowns(current, key)
    return shared * float(np.log(current.evidence.counts.sum())) + 2.0 * own


def unknowns(current: Refit, key: str) -> tuple[int, int]:
    """How many values a candidate brings for all runs, and how many that each run has."""
    robot = current.fit.model.robot
    parameters = effect_named(effect_of(key)).parameters(robot)
    own = sum(p.per_run for p in parameters)
    return int(inside(robot, key).sum()) - own, own * len(current.fit.samples)


def _complaint(current: Refit, one: Refit, name: str, noise_scales: Array, later: bool) -> str:
    """Why a refitted candidate does not pass, or nothing."""
    outside = plausible(one, name)
    if outside:
        return "; ".join(outside)
    excess, runs = excess_of(current), left_out(current, noise_scales)
    gain, gains = runs.share(one.score), runs.gains(one.score)
    if excess < -MOST_BELOW_NOISE:
        return (
            f"left-out runs are predicted without it, {-100 * excess:.0f} % below their noise: "
            "nothing is missing there"
        )
    chance = included(current, one, name, noise_scales)
    if chance <= ACCEPTED:
        return f"not sure: with probability {chance:.2g} it is there rather than nothing"
    worse = runs_worse(current.score.surprise - one.score.surprise, current.score)
    if gains.sum() <= 0.0 or worse > MOST_WORSE * len(gains):
        return f"{worse} of {len(gains)} left-out runs are predicted worse with it"
    if worse >= CONTRADICTED * len(gains) and gains.sum() < 2.0 * _scatter(gains):
        said = f"{worse} of {len(gains)} left-out runs are predicted worse with it, and its gain is"
        return f"{said} within the scatter from run to run"
    # At the noise as well: squares are blind to what evidence is sure of.
    if later and gain < LEAST_GAIN_LATER:
        return (
            f"it would remove {100 * gain:.0f} % of an excess of {100 * excess:.0f} % over the "
            "noise: too little to claim another effect"
        )
    return ""


def runs_worse(gains: Array, before: Score) -> int:
    """How many runs lose what counts beside themselves and the mean gain, by each's gain (r,).

    A run at its noise loses a little to what the others leave uncertain.
    """
    least = np.maximum(NO_WORSE * before.held_out, NO_WORSE_OF_GAIN * gains.mean())
    return int((gains < -least).sum())


def left_out(current: Refit, noise_scales: Array) -> LeftOut:
    """The runs, each left out, as a fit predicts them."""
    independent = independent_numbers(current.fit, noise_scales)
    return LeftOut(current.score, current.evidence.counts, independent, LEAST_EXCESS)


def excess_of(current: Refit) -> float:
    """How much more than the noise predicts the left-out runs' squares are, as a share."""
    return current.held_out / float(current.evidence.counts.sum()) - 1.0


def lacks_little(current: Refit) -> bool:
    """Whether samples of left-out runs and the stated lengths are as their noise leaves them."""
    return excess_of(current) < LEAST_EXCESS_LATER and not lengths_off(current.fit)


def _winner(
    passed: dict[str, Refit], chances: dict[str, float], current: Refit, runs: LeftOut
) -> tuple[str, tuple[str, ...]]:
    """The best of those that passed, and all effects that the runs cannot tell from it.

    These are the ones that left-out runs predict as well but for the noise, and those that may
    well be it instead. Of those about as probable as any that predict as well, the one with fewest
    unknowns leads, then the one that predicts best.
    """
    if not passed:
        return "", ()
    gains = {name: float(runs.gains(one.score).sum()) for name, one in passed.items()}
    best = max(gains.values())
    behind = {n: 2.0 * (best - gain) >= CONFOUNDED_DIFFERENCE for n, gain in gains.items()}
    group = [name for name in passed if not behind[name] or chances[name] > RIVAL]
    likely = CLEARLY_LIKELIER * max(chances[n] for n in group)
    group.sort(key=lambda n: (chances[n] < likely, behind[n], sum(unknowns(current, n)), -gains[n]))
    return group[0], tuple(dict.fromkeys(map(effect_of, group)))


def _ahead(key: str, group: dict[str, Refit], runs: LeftOut) -> tuple[str, Refit] | None:
    """Who of a group is predicted better than its leader by more than the noise, with its fit."""
    gains = {name: float(runs.gains(one.score).sum()) for name, one in group.items()}
    best = max(gains, key=lambda name: gains[name], default=key)
    is_ahead = best != key and 2.0 * (gains[best] - gains[key]) >= CONFOUNDED_DIFFERENCE
    return (best, group[best]) if is_ahead else None


def _scatter(gains: Array) -> float:
    """Standard error of a sum over runs, from how the runs differ."""
    return float(np.std(gains, ddof=1)) * float(np.sqrt(len(gains)))


def _verdict(
    key: str,
    winner: str,
    group: tuple[str, ...],
    complaints: dict[str, str],
    known: Refit | None,
    passed: dict[str, Refit],
    gain: float,
) -> tuple[str, str, tuple[str, ...]]:
    name = effect_of(key)
    if name in group:
        others = tuple(n for n in group if n != name)
        if others:
            return "confounded", f"these runs cannot tell it from {', '.join(others)}", others
        return "accepted", f"removes {100 * gain:.1f} % of the held-out excess over the noise", ()
    if key in complaints:
        return "rejected", complaints[key], ()
    if known is not None and key in passed and winner:
        return "rejected", f"{effect_of(winner)} predicts left-out runs better", ()
    if known is not None:
        return "rejected", "its fit could not be completed", ()
    if round(100.0 * gain, 1) <= 0.0:
        return "rejected", "removes nothing of the excess to first order", ()
    return "rejected", f"removes at most {100 * gain:.1f} % of the excess to first order", ()
