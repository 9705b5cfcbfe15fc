"""The search for what a bench lacks: one cause after the other, the best of those fitted first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.cdpr.system.progress import Progress
from freeswing.ident.bench.diagnose.causes import Cause, dressed, wanting
from freeswing.ident.bench.diagnose.weigh import Fit, chances
from freeswing.ident.bench.fit_rounds import FINE
from freeswing.ident.bench.noise import rescaled
from freeswing.ident.bench.swing import BenchSwing
from freeswing.ident.diagnose.decision import (
    ACCEPTED,
    CONFOUNDED_DIFFERENCE,
    LEAST_GAIN,
    MOST_WORSE,
    NEARLY_AS_GOOD,
    REFITTED,
    RIVAL,
    runs_worse,
)
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_blocks import linear_problem
from freeswing.ident.likelihood.unknowns import Unknowns

MOST_CAUSES = 4  # more than that one bench never tells apart


@dataclass(frozen=True, slots=True)
class Word:
    """What became of a cause in a round.

    Attributes:
        cause: which.
        verdict: accepted, confounded or rejected.
        gain: share of the left-out runs' excess over the noise that it takes away.
        chance: that it is what is missing, among those fitted and none of them; None: not fitted.
        delta_bic: BIC with it less BIC without it.
        others: causes that left-out runs cannot tell from it.
        reason: a sentence.
    """

    cause: Cause
    verdict: str
    gain: float
    chance: float | None
    delta_bic: float
    others: tuple[Cause, ...]
    reason: str


@dataclass(frozen=True, slots=True)
class Round:
    """One round.

    Attributes:
        words: what became of every cause.
        winner: the fit that goes on, or None.
        rivals: fits with what left-out runs cannot tell from the winner's, under the same noise.
        unborne: without a winner, the fit without and each with what is probable all the same:
            too few runs bear it out, and what it would change is not known to be right.
    """

    words: tuple[Word, ...]
    winner: Fit | None
    rivals: tuple[Fit, ...] = ()
    unborne: tuple[tuple[Fit, Fit], ...] = ()


@dataclass(frozen=True, slots=True)
class Ground:
    """What all fits of a search have in common.

    Attributes:
        swings: the runs without any cause.
        shares: of the mass that causes are told for, by run, (r,).
        fastest_hz: highest frequency of small oscillations.
    """

    swings: tuple[BenchSwing, ...]
    shares: Array
    fastest_hz: float

    def with_causes(self, before: Fit, causes: Sequence[Cause]) -> Fit:
        """A model with some causes, begun at a fit with fewer.

        Raises:
            ValueError: when a run cannot be simulated from there.
        """
        swings = tuple(
            replace(mine, columns=seen.columns)
            for mine, seen in zip(
                dressed(self.swings, causes, self.shares), before.swings, strict=True
            )
        )
        found = fit(swings, wanting(before.solution.unknowns, causes), FINE)
        return Fit(swings, found, tuple(causes))

    def reweighed(self, one: Fit, by: Fit) -> Fit:
        """A fit under the noise that another one leaves."""
        noisy = rescaled(by.swings, by.solution, self.fastest_hz, coloured=True)
        swings = tuple(
            replace(mine, columns=seen.columns)
            for mine, seen in zip(one.swings, noisy, strict=True)
        )
        return Fit(swings, fit(swings, one.solution.unknowns, FINE), one.causes)


def promised(ground: Ground, before: Fit, causes: Sequence[Cause]) -> dict[str, float]:
    """By how much each cause would lower the cost to first order, by block.

    Source:
        Bjoerck 1996, Numerical Methods for Least Squares Problems, sec. 6.3.
    """
    rows, mine, added, _ = joint_rows(ground, before, causes)
    alone = _cost(rows, mine)
    return {name: alone - _cost(rows, np.r_[mine, own]) for name, own in added.items()}


def joint_rows(
    ground: Ground, before: Fit, causes: Sequence[Cause]
) -> tuple[Array, Array, dict[str, Array], Unknowns]:
    """The linear problem of a fit with all of some causes added.

    Returns:
        Rows (m, p + 1) over unknowns and residual in units of their scales, the places of what the
        fit has already (q,), those of each cause's numbers by its block, and the unknowns.

    Source:
        Bjoerck 1996, Numerical Methods for Least Squares Problems, sec. 6.3.
    """
    every = (*before.causes, *causes)
    swings = tuple(
        replace(mine, columns=seen.columns)
        for mine, seen in zip(
            dressed(ground.swings, every, ground.shares), before.swings, strict=True
        )
    )
    unknowns = wanting(before.solution.unknowns, every)
    linear = linear_problem(swings, unknowns)
    rows = np.vstack([linear.triangles.reshape(-1, linear.triangles.shape[-1]), linear.prior_rows])
    estimated = np.concatenate([block.mask for block in unknowns.shared])
    places = np.cumsum(estimated) - 1
    added = {cause.block: places[unknowns.place(cause.block)] for cause in causes}
    mine = np.setdiff1d(np.arange(rows.shape[1] - 1), np.concatenate(list(added.values())))
    return rows, mine, added, unknowns


def _cost(rows: Array, columns: Array) -> float:
    kept = rows[:, np.r_[columns, rows.shape[1] - 1]]
    return float(np.asarray(np.linalg.qr(kept, mode="r"))[-1, -1] ** 2)


def searched(
    ground: Ground, start: Fit, causes: Sequence[Cause], told: Progress
) -> tuple[Fit, list[Round]]:
    """Causes one after the other, until none is accepted.

    Args:
        ground: of all fits.
        start: the fit without any.
        causes: the candidates.
        told: progress, a label and a share.
    """
    current, rounds = start, []
    while len(rounds) <= MOST_CAUSES:
        left = [one for one in causes if one not in current.causes]
        one = _round(ground, current, left, told)
        rounds.append(one)
        if one.winner is None:
            break
        current = one.winner
    return current, rounds


def _round(ground: Ground, current: Fit, causes: Sequence[Cause], told: Progress) -> Round:
    if not causes:
        return Round((), None)
    gains = promised(ground, current, causes)
    ranked = sorted(causes, key=lambda one: -gains[one.block])
    chosen = [one for one in ranked if gains[one.block] > LEAST_GAIN][: 2 * REFITTED]
    fits: dict[str, Fit] = {}
    for k, cause in enumerate(chosen):
        told(cause.effect, k / max(1, len(chosen)))
        try:
            fits[cause.block] = ground.with_causes(current, (*current.causes, cause))
        except (ValueError, np.linalg.LinAlgError):
            continue
    lower = {name: current.solution.cost - one.solution.cost for name, one in fits.items()}
    good = [name for name, gain in lower.items() if gain > LEAST_GAIN]
    if not good:
        words = [_unfit(current, one, gains, lower) for one in ranked]
        return Round(tuple(words), None)
    best = max(good, key=lambda name: lower[name])
    near = [name for name in good if lower[name] >= NEARLY_AS_GOOD * lower[best]]
    weighed = {name: ground.reweighed(fits[name], fits[best]) for name in near}
    before = ground.reweighed(current, fits[best])
    words = {one.block: _unfit(current, one, gains, lower) for one in ranked}
    return _judged(before, weighed, words)


def _judged(
    before: Fit,
    weighed: dict[str, Fit],
    words: dict[str, Word],
) -> Round:
    """The verdict once all that come near the best were fitted under its noise.

    Args:
        before: without any of them.
        weighed: those that come near the best, by block.
        words: of all others, in the order of what they promise.
    """
    by_block = {name: word.cause for name, word in words.items()}
    counts = min(weighed.values(), key=lambda one: one.solution.cost).squares
    shares = chances([before, *weighed.values()], counts)[1:]
    chance = dict(zip(weighed, shares.tolist(), strict=True))
    complaints = {name: _complaint(before, one, counts) for name, one in weighed.items()}
    likeliest = max(chance, key=lambda name: chance[name])
    for name in weighed:
        # What left-out runs bear out is not it where another is so much more probable.
        if not complaints[name] and complaints[likeliest] and chance[name] <= RIVAL:
            complaints[name] = f"{by_block[likeliest].effect} is far more probable"
    passed = [name for name in weighed if not complaints[name]]
    group: list[str] = []
    if passed:
        first = min(passed, key=lambda name: weighed[name].score.surprise.sum())
        least = weighed[first].score.surprise.sum() + CONFOUNDED_DIFFERENCE
        group = [
            name for name in passed
            if weighed[name].score.surprise.sum() < least or chance[name] > RIVAL
        ]  # fmt: skip
        group.sort(key=lambda n: (len(by_block[n].parameters), weighed[n].score.surprise.sum()))
    for name in weighed:
        cause = by_block[name]
        share = _share(before, weighed[name], counts)
        bic = weighed[name].solution.cost - before.solution.cost
        bic += len(cause.parameters) * float(np.log(counts.sum()))
        others = tuple(by_block[n] for n in group if n != name) if name in group else ()
        verdict, reason = "rejected", complaints[name]
        if name in group:
            verdict = "confounded" if others else "accepted"
            reason = f"removes {100 * share:.1f} % of the left-out runs' excess over the noise"
        elif not reason and group:
            reason = f"{by_block[group[0]].effect} predicts left-out runs better"
        words[name] = Word(cause, verdict, share, chance[name], bic, others, reason)
    told = tuple(words.values())
    if not group:
        probable = [name for name in weighed if chance[name] > RIVAL]
        return Round(told, None, unborne=tuple((before, weighed[name]) for name in probable))
    return Round(told, weighed[group[0]], tuple(weighed[name] for name in group[1:]))


def _complaint(before: Fit, one: Fit, counts: Array) -> str:
    """Why a cause does not pass, or nothing."""
    chance = float(chances([before, one], counts)[1])
    if chance <= ACCEPTED:
        return f"not sure: with probability {chance:.2g} it is there rather than nothing"
    gains = before.score.surprise - one.score.surprise
    worse = runs_worse(gains, before.score)
    if gains.sum() <= 0.0 or worse > MOST_WORSE * len(gains):
        return f"{worse} of {len(gains)} left-out runs are predicted worse with it"
    return ""


def _share(before: Fit, one: Fit, counts: Array) -> float:
    """Share of the left-out runs' excess over the noise that a cause takes away."""
    excess = float(before.score.surprise.sum() - counts.sum())
    gain = float(before.score.surprise.sum() - one.score.surprise.sum())
    return gain / max(excess, LEAST_GAIN)


def _unfit(current: Fit, cause: Cause, gains: dict[str, float], lower: dict[str, float]) -> Word:
    """A cause that promised too little, or whose fit gave too little."""
    name = cause.block
    cost = max(current.solution.cost, 1e-300)
    promise = max(0.0, gains[name]) / cost
    bic = -lower.get(name, gains[name]) + len(cause.parameters) * np.log(current.squares.sum())
    if name in lower:
        reason = f"fitted, it removes {100 * max(lower[name], 0.0) / cost:.1f} % of the misfit"
    elif gains[name] > LEAST_GAIN:
        reason = f"would remove {100 * promise:.1f} % of the misfit to first order; others do more"
    else:
        reason = f"removes {100 * promise:.1f} % of the misfit to first order"
    return Word(cause, "rejected", promise, None, float(bic), (), reason)
