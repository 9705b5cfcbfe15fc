"""Which candidates are worth fitting, and what held-out runs decide of those that were fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from cdpr.effects import effect_named
from cdpr.robot import Array
from ident.diagnose.refit import Refit, colour_of, plausible
from ident.diagnose.rows import Score

REFITTED = 4
NEARLY_AS_GOOD = 0.5
LEAST_GAIN = 10.0
SIGNIFICANCE = 1e-3
LARGEST_DELTA_BIC = -10.0
# A cause helps wherever it shows; what trades small swings for large ones is a stand-in.
MOST_WORSE = 0.25
NO_WORSE = 0.01
# A second effect must be worth its place: integrators, shapes of friction and points of
# application differ a little from reality, and 0.1 mm samples see it.
LEAST_GAIN_LATER = 0.25
LEAST_EXCESS_LATER = 0.04
CONFOUNDED_DIFFERENCE = 12.0
LEAST_EXCESS = 0.005


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
    """

    effect: str
    verdict: str
    delta_bic: float
    held_out_gain: float
    confounded_with: tuple[str, ...]
    reason: str


@dataclass(frozen=True, slots=True)
class Decision:
    """What became of the candidates of a round, who won, and who cannot be told from it."""

    candidates: tuple[Candidate, ...]
    winner: Refit | None
    group: tuple[str, ...]


def promising(current: Refit, linear: dict[str, Score], colour: float) -> list[str]:
    """The candidates worth fitting: those not far behind the linear best, by either measure.

    Left-out runs rank well what is well determined; a tether or an offset has more unknowns than
    a linear step settles beside a large residual, and shows in the likelihood first.
    """
    count = float(np.log(current.evidence.counts.sum()))
    held_out = {n: current.held_out - float(one.held_out.sum()) for n, one in linear.items()}
    likelihood = {
        n: (current.score.cost - one.cost) / colour - parameter_count(current, n) * count
        for n, one in linear.items()
    }
    chosen: list[str] = []
    for gains in (held_out, likelihood):
        ranked = sorted(gains, key=lambda n: -gains[n])
        least = max(NEARLY_AS_GOOD * gains[ranked[0]], LEAST_GAIN)
        chosen += [n for n in ranked[:REFITTED] if gains[n] > least and n not in chosen]
    return chosen


def decided(
    current: Refit,
    linear: dict[str, Score],
    tried: dict[str, Refit],
    index: int,
    colour: float,
    noise_scales: Array,
) -> Decision:
    """The verdict of a round.

    Args:
        current: the fit without any of the candidates.
        linear: what each makes of the linear evidence.
        tried: those that were fitted.
        index: of the round, from 0.
        colour: of the current residual.
        noise_scales: of metres and radians, (2,).
    """
    count = float(current.evidence.counts.sum())
    excess = max(current.held_out - count, LEAST_EXCESS * count)
    ranked = sorted(linear, key=lambda name: float(linear[name].held_out.sum()))
    complaints: dict[str, str] = {}
    passed: dict[str, Refit] = {}
    for name, one in tried.items():
        complaint = _complaint(current, one, name, colour, len(ranked), index, count)
        if complaint:
            complaints[name] = complaint
        else:
            passed[name] = one
    winner, group = _winner(passed, current, noise_scales)
    candidates = []
    for name in ranked:
        known = tried.get(name)
        held_out = known.held_out if known else float(linear[name].held_out.sum())
        n_new = parameter_count(current, name)
        bic = delta_bic(current, known.score if known else linear[name], n_new, colour)
        gain = float((current.held_out - held_out) / excess)
        verdict, reason, others = _verdict(name, winner, group, complaints, known, passed, gain)
        candidates.append(Candidate(name, verdict, float(bic), gain, others, reason))
    return Decision(tuple(candidates), winner, group)


def delta_bic(current: Refit, one: Score, n_new: int, colour: float) -> float:
    """BIC with an effect of so many unknowns less BIC without it, the residual's colour allowed."""
    count = float(current.evidence.counts.sum())
    return (one.cost - current.score.cost) / colour + n_new * float(np.log(count))


def _complaint(
    current: Refit, one: Refit, name: str, colour: float, n_tried: int, index: int, count: float
) -> str:
    """Why a refitted candidate does not pass, or nothing."""
    outside = plausible(one, name)
    if outside:
        return "; ".join(outside)
    n_new = parameter_count(current, name)
    drop = (current.score.cost - one.score.cost) / colour
    chance = min(1.0, float(chi2.sf(max(drop, 0.0), n_new)) * n_tried)
    if chance > SIGNIFICANCE or delta_bic(current, one.score, n_new, colour) > LARGEST_DELTA_BIC:
        return f"not significant: p = {chance:.2g} with {n_tried} candidates tried"
    gains = current.score.held_out - one.score.held_out
    worse = int((gains < -NO_WORSE * current.score.held_out).sum())
    if gains.sum() <= 0.0 or worse > MOST_WORSE * len(gains):
        return f"{worse} of {len(gains)} left-out runs are predicted worse with it"
    excess = excess_of(current)
    gain = float(gains.sum()) / max(current.held_out - count, LEAST_EXCESS * count)
    if index and (excess < LEAST_EXCESS_LATER or gain < LEAST_GAIN_LATER):
        return (
            f"it would remove {100 * gain:.0f} % of an excess of {100 * excess:.0f} % over the "
            "noise: too little to claim another effect"
        )
    return ""


def parameter_count(current: Refit, name: str) -> int:
    """Unknowns that an effect brings, those of each run counted."""
    parameters = effect_named(name).parameters(current.fit.model.robot)
    own = sum(parameter.per_run for parameter in parameters)
    return len(parameters) + own * (len(current.fit.samples) - 1)


def excess_of(current: Refit) -> float:
    """How much more than the noise predicts the left-out runs' squares are, as a share."""
    return current.held_out / float(current.evidence.counts.sum()) - 1.0


def _winner(
    passed: dict[str, Refit], current: Refit, noise_scales: Array
) -> tuple[Refit | None, tuple[str, ...]]:
    """The best of those that passed, and all that held-out runs cannot tell from it."""
    if not passed:
        return None, ()
    best = min(passed.values(), key=lambda one: one.held_out)
    colour = colour_of(best.fit, noise_scales)
    group = [
        name
        for name, one in passed.items()
        if (one.held_out - best.held_out) / colour < CONFOUNDED_DIFFERENCE
    ]
    robot = current.fit.model.robot
    group.sort(key=lambda n: (len(effect_named(n).parameters(robot)), passed[n].held_out))
    return passed[group[0]], tuple(group)


def _verdict(
    name: str,
    winner: Refit | None,
    group: tuple[str, ...],
    complaints: dict[str, str],
    known: Refit | None,
    passed: dict[str, Refit],
    gain: float,
) -> tuple[str, str, tuple[str, ...]]:
    if winner is not None and name in group:
        others = tuple(n for n in group if n != name)
        if others:
            return "confounded", f"held-out runs cannot tell it from {', '.join(others)}", others
        return "accepted", f"removes {100 * gain:.1f} % of the held-out excess over the noise", ()
    if name in complaints:
        return "rejected", complaints[name], ()
    if known is not None and name in passed and winner is not None:
        return "rejected", f"{winner.effects[-1]} predicts left-out runs better", ()
    if known is not None:
        return "rejected", "its fit could not be completed", ()
    return "rejected", f"removes at most {100 * gain:.1f} % of the excess to first order", ()
