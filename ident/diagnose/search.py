"""Forward search for missing effects with removal, decided on runs that were left out.

A round screens all candidates linearly, fits the most promising in earnest, and takes the one
that predicts left-out runs best, if it passes: significant against a residual as coloured as the
one at hand and with as many candidates as were tried, better on most runs, within its plausible
range, and large enough to matter. Candidates that held-out runs cannot tell from it form a group.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from multiprocessing import get_context

import numpy as np
from scipy.stats import chi2

from cdpr.effects import effect_named
from cdpr.robot import Array, Robot
from ident.diagnose.refit import Refit, colour_of, plausible, refit, rescored
from ident.diagnose.rows import score
from ident.diagnose.screen import Screen, screen
from ident.diagnose.spectrum import common_frequency, too_small
from ident.likelihood import LikelihoodFit, fit

Progress = Callable[[str, float], None]

REFITTED = 5
NEARLY_AS_GOOD = 0.5
MOST_ROUNDS = 4
SIGNIFICANCE = 1e-3
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
class Round:
    """One round of the search: what stood before, who was tried, who won."""

    before: Refit
    candidates: tuple[Candidate, ...]
    winner: Refit | None
    group: tuple[str, ...]


@dataclass(slots=True)
class Search:
    """State of a search.

    Attributes:
        noise_scales: of metres and radians, (2,).
        candidates: names still to be considered.
        workers: processes that fit candidates side by side.
        executor: fits them instead, such as a cluster's; left open.
        progress: told a label and a fraction.
    """

    noise_scales: Array
    candidates: tuple[str, ...]
    workers: int = 2
    executor: Executor | None = None
    progress: Progress | None = None
    rounds: list[Round] = field(default_factory=list)

    def run(self, base: LikelihoodFit) -> Refit:
        """Add effects to a base fit until none passes; the last fit."""
        self._tell("base dynamics", 0.0)
        current = rescored(base, self.noise_scales, colour_of(base, self.noise_scales))
        for index in range(MOST_ROUNDS):
            if index and (_excess(current) < LEAST_EXCESS_LATER or too_small(current.fit)):
                break
            done = self._round(current, index)
            self.rounds.append(done)
            if done.winner is None:
                break
            current = done.winner
        return current

    def _tell(self, label: str, fraction: float) -> None:
        if self.progress:
            self.progress(label, fraction)

    def _round(self, current: Refit, index: int) -> Round:
        share = 1.0 / MOST_ROUNDS
        self._tell(f"round {index + 1}: screening", index * share)
        left = [n for n in self.candidates if n not in current.effects]
        if not left:
            return Round(current, (), None, ())
        colour = colour_of(current.fit, self.noise_scales)
        screens = self._screens(current.fit, left, colour)
        linear = {name: _linear_held_out(screens[name], name) for name in left}
        ranked = sorted(linear, key=lambda name: linear[name])
        promising = _promising(ranked, linear, current)
        tried = self._refits(current, screens, promising, index, colour)
        return self._polished(
            _decided(current, linear, ranked, tried, index, colour, self.noise_scales)
        )

    def _polished(self, done: Round) -> Round:
        """The round with its winner fitted to convergence: ranking stops early."""
        if done.winner is None:
            return done
        found = done.winner.fit
        colour = colour_of(found, self.noise_scales)
        state = replace(found.state, scales=self.noise_scales * np.sqrt(colour))
        exact = fit(found.model, found.samples, state, estimate_scales=False, grow=False)
        return replace(done, winner=rescored(exact, self.noise_scales, colour))

    def _screens(
        self, found: LikelihoodFit, names: Sequence[str], colour: float
    ) -> dict[str, Screen]:
        """Linear evidence by candidate.

        Those that need tensions stand apart because they cost more, those with values for each
        run because they are eliminated with the runs' states.
        """
        shapes = {}
        frequency = common_frequency(found, self.noise_scales)
        if "harmonic_force" in names:
            shapes["harmonic_force"] = {"frequency_hz": frequency}
        screens: dict[str, Screen] = {}
        robot = found.model.robot
        for kind in ((False, False), (True, False), (False, True)):
            group = [n for n in names if _kind(n, robot) == kind]
            if group:
                together = screen(found, group, self.noise_scales, shapes, colour)
                screens |= dict.fromkeys(group, together)
        return screens

    def _refits(
        self,
        current: Refit,
        screens: dict[str, Screen],
        names: Sequence[str],
        index: int,
        colour: float,
    ) -> dict[str, Refit]:
        jobs = [
            (current, name, _start_of(screens[name], name), self.noise_scales, colour)
            for name in names
        ]
        share = 1.0 / MOST_ROUNDS
        found: dict[str, Refit] = {}
        if not jobs:
            return found
        if self.workers < 2 and self.executor is None:
            results = (_job(*job) for job in jobs)
            for k, (name, result) in enumerate(zip(names, results, strict=True)):
                self._tell(f"round {index + 1}: {name}", (index + (k + 1) / len(jobs)) * share)
                found |= {} if result is None else {name: result}
            return found
        with self._pool() as pool:
            futures = [pool.submit(_job, *job) for job in jobs]
            for k, (name, future) in enumerate(zip(names, futures, strict=True)):
                self._tell(f"round {index + 1}: {name}", (index + k / len(jobs)) * share)
                result = future.result()
                found |= {} if result is None else {name: result}
        return found

    def _pool(self) -> AbstractContextManager[Executor]:
        if self.executor is not None:
            return nullcontext(self.executor)
        return ProcessPoolExecutor(self.workers, mp_context=get_context("fork"))


def _kind(name: str, robot: Robot) -> tuple[bool, bool]:
    effect = effect_named(name)
    return effect.needs_tension, any(p.per_run for p in effect.parameters(robot))


def _job(
    current: Refit,
    name: str,
    values: Array,
    noise_scales: Array,
    colour: float,
) -> Refit | None:
    try:
        return refit(current.fit, name, values, noise_scales, colour)
    except ValueError:
        return None


def _linear_held_out(one: Screen, name: str) -> float:
    return float(score(one.with_candidate(name)).held_out.sum())


def _start_of(one: Screen, name: str) -> Array:
    """Values of a candidate at which it does nothing, its shape as it was screened, (k,)."""
    parameters = effect_named(name).parameters(one.model.robot)
    first = one.model.names.index(f"{name}.{parameters[0].name}")
    return one.values[first : first + len(parameters)].copy()


def _promising(ranked: Sequence[str], linear: dict[str, float], current: Refit) -> list[str]:
    """The candidates worth fitting: the linear best and those that are not far behind."""
    gain = current.held_out - linear[ranked[0]]
    within = [n for n in ranked if current.held_out - linear[n] > max(NEARLY_AS_GOOD * gain, 10.0)]
    return within[:REFITTED]


def _decided(
    current: Refit,
    linear: dict[str, float],
    ranked: Sequence[str],
    tried: dict[str, Refit],
    index: int,
    colour: float,
    noise_scales: Array,
) -> Round:
    count = float(current.evidence.counts.sum())
    excess = max(current.held_out - count, LEAST_EXCESS * count)
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
        held_out = known.held_out if known else linear[name]
        n_new = _parameter_count(current, name)
        bic = (
            _delta_bic(current, known, n_new, colour, count)
            if known
            else ((linear[name] - current.held_out) / colour + n_new * np.log(count))
        )
        gain = float((current.held_out - held_out) / excess)
        verdict, reason, others = _verdict(name, winner, group, complaints, known, passed, gain)
        candidates.append(Candidate(name, verdict, float(bic), gain, others, reason))
    return Round(current, tuple(candidates), winner, group)


def _delta_bic(current: Refit, one: Refit, n_new: int, colour: float, count: float) -> float:
    return (one.score.cost - current.score.cost) / colour + n_new * float(np.log(count))


def _complaint(
    current: Refit, one: Refit, name: str, colour: float, n_tried: int, index: int, count: float
) -> str:
    """Why a refitted candidate does not pass, or nothing."""
    outside = plausible(one, name)
    if outside:
        return "; ".join(outside)
    n_new = _parameter_count(current, name)
    drop = (current.score.cost - one.score.cost) / colour
    chance = min(1.0, float(chi2.sf(max(drop, 0.0), n_new)) * n_tried)
    if chance > SIGNIFICANCE or _delta_bic(current, one, n_new, colour, count) > -10.0:
        return f"not significant: p = {chance:.2g} with {n_tried} candidates tried"
    gains = current.score.held_out - one.score.held_out
    worse = int((gains < -NO_WORSE * current.score.held_out).sum())
    if gains.sum() <= 0.0 or worse > MOST_WORSE * len(gains):
        return f"{worse} of {len(gains)} left-out runs are predicted worse with it"
    excess = _excess(current)
    gain = float(gains.sum()) / max(current.held_out - count, LEAST_EXCESS * count)
    if index and (excess < LEAST_EXCESS_LATER or gain < LEAST_GAIN_LATER):
        return (
            f"it would remove {100 * gain:.0f} % of an excess of {100 * excess:.0f} % over the "
            "noise: too little to claim another effect"
        )
    return ""


def _parameter_count(current: Refit, name: str) -> int:
    """Unknowns that an effect brings, those of each run counted."""
    parameters = effect_named(name).parameters(current.fit.model.robot)
    own = sum(parameter.per_run for parameter in parameters)
    return len(parameters) + own * (len(current.fit.samples) - 1)


def _excess(current: Refit) -> float:
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
