"""Forward search for missing effects with removal, decided on runs that were left out.

A round screens all candidates linearly, fits the most promising in earnest, and takes the one
that predicts left-out runs best, if it passes: significant against a residual as coloured as the
one at hand and with as many candidates as were tried, better on most runs, within its plausible
range, and large enough to matter. Candidates that held-out runs cannot tell from it form a group.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from multiprocessing import get_context

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.robot import Array, Robot
from freeswing.cdpr.system.lifeline import tie_to
from freeswing.cdpr.system.progress import Progress
from freeswing.ident.diagnose.backward_removal import (
    is_no_worse,
    outdone,
    superfluous,
    turned,
    would_explain,
)
from freeswing.ident.diagnose.decision import (
    LARGEST_EXCESS_LEFT,
    Decision,
    by_lengths,
    decided,
    excess_of,
    promising,
    settles,
)
from freeswing.ident.diagnose.leave_one_out import score
from freeswing.ident.diagnose.lengths.wrong_places import Kinematics, kinematics
from freeswing.ident.diagnose.refit import (
    Refit,
    colour_of,
    displaced,
    exchanged,
    freed,
    polished,
    refit,
    rescored,
    without,
)
from freeswing.ident.diagnose.screen import Group, Screen, screens
from freeswing.ident.diagnose.sets.exchange import decisions, exchange
from freeswing.ident.diagnose.sets.rivals_again import asked_again
from freeswing.ident.diagnose.sets.ways import Places
from freeswing.ident.diagnose.spectrum import Residual, too_small
from freeswing.ident.diagnose.springs.full_motion import fully, fully_by_now
from freeswing.ident.diagnose.variants import effect_of, inside, variants
from freeswing.ident.likelihood.fit_swings import LikelihoodFit

# A day in the laboratory had five effects at once: four rounds never looked for the fifth.
MOST_ROUNDS = 8


@dataclass(frozen=True, slots=True)
class Round:
    """One round of the search: what stood before, what was decided, what was taken away again.

    Those that cable lengths decide, before any force, say so; those whose winner stands in for
    something else say why (`outdone`), those without a winner what would be it (`would_explain`).
    """

    before: Refit
    decision: Decision
    removed: tuple[str, ...] = ()
    by_lengths: bool = False
    stand_in: str = ""

    @property
    def after(self) -> Refit:
        """The fit that stood at its end."""
        return self.decision.winner or self.before


@dataclass(slots=True)
class Search:
    """State of a search.

    Attributes:
        noise_scales: of metres and radians, (2,).
        candidates: names still to be considered.
        workers: processes that fit candidates side by side.
        executor: fits them instead, such as a cluster's; left open.
        progress: told a label and a fraction.
        kinematics: what cable lengths say, once they were asked.
        pool: makes the fits while a search runs; its processes keep what they have built.
    """

    noise_scales: Array
    candidates: tuple[str, ...]
    workers: int = 2
    executor: Executor | None = None
    progress: Progress | None = None
    rounds: list[Round] = field(default_factory=list)
    kinematics: Kinematics | None = None
    pool: Executor | None = None

    def run(self, base: LikelihoodFit) -> Refit:
        """Add effects to a base fit until none passes; the last fit."""
        self._tell("base dynamics", 0.0)
        current = rescored(base, self.noise_scales, colour_of(base, self.noise_scales))
        current = self._freed(self._geometry(current))
        with self.pool_of() as self.pool:
            current = self._other_way(self._followed(current, 0))
        return self._asked_again(self._without_stand_ins(current))

    def _followed(self, current: Refit, first: int) -> Refit:
        """The last fit of the rounds from `first` on, until none adds anything."""
        for index in range(first, MOST_ROUNDS):
            if index and too_small(current.fit):
                break
            done = self._round(current, index)
            self.rounds += self._instead(done, index)
            done = self.rounds[-1]
            if done.decision.winner is None:
                break
            current = done.after
        return current

    def _other_way(self, current: Refit) -> Refit:
        """The end of the way that left-out runs would have gone, where this one ends far off.

        While others are missing, evidence is in few numbers: what is likelier then may be the worse
        start. Where the search has ended with much missing and a group had one that left-out runs
        predict far better, that one is followed too, and stands where it ends near the noise.
        """
        forks = [(k, one.decision.ahead) for k, one in enumerate(self.rounds) if one.decision.ahead]
        if not forks or excess_of(current) <= LARGEST_EXCESS_LEFT:
            return current
        (first, (key, fit)), taken = forks[0], self.rounds
        fork, self.rounds = taken[first], taken[:first]
        index = sum(not one.by_lengths for one in self.rounds)
        led = turned(fork.decision, key, fit)
        done = self._ended(fork.before, led, fit, index, fork.stand_in)
        self.rounds += self._instead(done, index)
        other = self._followed(self.rounds[-1].after, index + 1)
        if excess_of(other) <= LARGEST_EXCESS_LEFT:
            return other
        self.rounds = taken
        return current

    def _without_stand_ins(self, current: Refit) -> Refit:
        """The last fit without what came last and stood in for something else.

        Where other effects were still missing, one that stood in for them all led for a while.
        """
        while True:
            won = [k for k, one in enumerate(self.rounds) if one.decision.winner is not None]
            if not won or not self.rounds[won[-1]].stand_in:
                return current
            last = self.rounds[won[-1]]
            words = [
                replace(one, verdict="rejected", confounded_with=(), reason=last.stand_in)
                if one.effect in last.decision.group
                else one
                for one in last.decision.candidates
            ]
            self.rounds[won[-1] :] = [Round(last.before, Decision(tuple(words)))]
            current = last.before

    def _asked_again(self, current: Refit) -> Refit:
        """The last fit, each group held against its leader once nothing else is missing."""
        if excess_of(current) > LARGEST_EXCESS_LEFT:
            return current
        won = [k for k, one in enumerate(self.rounds) if one.decision.winner is not None]
        told = [self.rounds[k].decision for k in won]
        told, current = asked_again(told, current, self.noise_scales)
        for k, one in zip(won, told, strict=True):
            self.rounds[k] = replace(self.rounds[k], decision=one)
        return current

    def _geometry(self, current: Refit) -> Refit:
        """Kinematics first: what constant cable lengths settle, no force has to explain."""
        robot = current.fit.model.robot
        keys = [
            key
            for name in self.candidates
            if effect_named(name).stage in ("kinematics", "measurement")
            for key in variants(robot, name)
        ]
        self._tell("kinematics: lengths along the runs", 0.0)
        self.kinematics = kinematics(current.fit, keys, self.noise_scales)
        for one in self.kinematics.wrong if self.kinematics else ():
            self._tell(f"kinematics: {effect_of(one.key)}", 0.0)
            after = displaced(current, one.keys, one.values, one.covariance, self.noise_scales)
            share = 1.0 - (one.after_m / one.before_m) ** 2
            words = by_lengths(one, share)
            decision = Decision(words, after, one.key, tuple(word.effect for word in words))
            self.rounds.append(Round(current, decision, by_lengths=True))
            current = after
        return current

    def _freed(self, current: Refit) -> Refit:
        """The fit without what all poses have wrong together, where nothing else is missing.

        A model that misses more would have these errors make up for it.
        """
        if excess_of(current) > LARGEST_EXCESS_LEFT:
            return current
        return freed(current, self.noise_scales)

    def _tell(self, label: str, fraction: float) -> None:
        if self.progress:
            self.progress(label, fraction)

    def _round(self, current: Refit, index: int) -> Round:
        self._tell(f"round {index + 1}: screening", index / MOST_ROUNDS)
        left = self._left(current)
        if not left:
            return Round(current, Decision(()))
        colour = colour_of(current.fit, self.noise_scales)
        seen = self._screens(current.fit, left, colour)
        linear = {name: score(seen[name].with_candidate(name)) for name in left}
        tried: dict[str, Refit] = {}
        asked: list[str] = []
        while True:
            more = promising(current, linear, colour, self.noise_scales, asked, bool(self.rounds))
            tried |= self._refits(current, seen, more, index, colour)
            asked += more
            decision = decided(current, linear, tried, bool(self.rounds), colour, self.noise_scales)
            if not more or settles(decision, current, self.noise_scales):
                break
        if decision.winner is None:
            return Round(current, decision, stand_in=would_explain(decision, tried))
        return self._ended(current, decision, decision.winner, index, outdone(decision, tried))

    def _ended(
        self, current: Refit, decision: Decision, winner: Refit, index: int, stand_in: str
    ) -> Round:
        """A round whose winner is fitted to its end, without what it makes superfluous."""
        # Ranking stopped early: the winner goes on to convergence.
        found, removed = polished(winner.fit, self.noise_scales), []
        found = self._freed(fully_by_now(found, self.noise_scales) if index else found)
        while name := superfluous(found, decision.group):
            self._tell(f"round {index + 1}: without {name}", (index + 0.9) / MOST_ROUNDS)
            fewer = without(found.fit, name, self.noise_scales)
            if not is_no_worse(fewer, found, name, self.noise_scales):
                break
            found = fewer
            removed.append(name)
        if winner.slowly:
            found = replace(found, slowly=winner.slowly)
        return Round(current, replace(decision, winner=found), tuple(removed), stand_in=stand_in)

    def _instead(self, done: Round, index: int) -> list[Round]:
        """What stands for a round, its place held against sets of places (`sets.exchange`)."""
        decision = done.decision
        if decision.winner is None:
            return [done]
        self._tell(
            f"round {index + 1}: places that may be wrong instead", (index + 0.95) / MOST_ROUNDS
        )
        told = exchange(
            done.before,
            decision.winner,
            decision.key,
            self._left(done.before),
            self.noise_scales,
            partial(self._of_sets, decision.winner, decision.key),
        )
        if told is None:
            return [done]
        before, rounds = done.before, []
        for one in decisions(decision, told):
            rounds.append(replace(done, before=before, decision=one))
            before = rounds[-1].after
        return rounds

    def _of_sets(
        self, found: Refit, key: str, begun: Sequence[tuple[Places, dict[str, Array]]]
    ) -> dict[Places, Refit]:
        """Fits with sets of places in place of one, without those that cannot be followed."""
        pool = self.pool
        jobs = {one: (found, key, one, values, self.noise_scales) for one, values in begun}
        calls = {
            one: pool.submit(_of_set, *job).result if pool else partial(_of_set, *job)
            for one, job in jobs.items()
        }
        made = {one: call() for one, call in calls.items()}
        return {one: refitted for one, refitted in made.items() if refitted is not None}

    def _left(self, current: Refit) -> list[str]:
        """Keys of what is not in the model yet: whole effects, and parts of any."""
        model, left = current.fit.model, []
        for name in self.candidates:
            keys = variants(model.robot, name)
            if name in current.effects:
                estimated = current.fit.unknowns.block(name).mask
                keys = [k for k in keys[1:] if not estimated[inside(model.robot, k)].any()]
            left += keys
        return left

    def _screens(
        self, found: LikelihoodFit, keys: Sequence[str], colour: float
    ) -> dict[str, Screen]:
        """Linear evidence by candidate.

        Those that need tensions stand apart because they cost more, those with values for each
        run because they are eliminated with the runs' states.
        """
        clues = Residual(found, self.noise_scales)
        guesses = {n: effect_named(n).shape_guesses(clues) for n in map(effect_of, keys)}
        shapes = {name: guess[0] for name, guess in guesses.items() if guess}
        robot = found.model.robot
        kinds = (
            [n for n in keys if _kind(effect_of(n), robot) == kind]
            for kind in ((False, False), (True, False), (False, True))
        )
        groups: list[Group] = [(group, shapes) for group in kinds if group]
        for key in keys:
            name = effect_of(key)
            groups += [([key], {name: shape}) for shape in guesses[name][1:]]
        told: dict[str, Screen] = {}
        for (group, _), one in zip(
            groups, screens(found, groups, self.noise_scales, colour), strict=True
        ):
            for key in group:
                told[key] = min(told[key], one, key=partial(_cost, key)) if key in told else one
        return told

    def _refits(
        self,
        current: Refit,
        seen: dict[str, Screen],
        names: Sequence[str],
        index: int,
        colour: float,
    ) -> dict[str, Refit]:
        jobs = {
            name: (current, name, seen[name].start_of(name), self.noise_scales, colour)
            for name in names
        }
        found: dict[str, Refit] = {}
        if not jobs:
            return found
        # Stretch takes longest: begun last, it would keep one process busy alone.
        longest_first = sorted(
            jobs, key=lambda name: not effect_named(effect_of(name)).needs_tension
        )
        pool = self.pool
        calls = {
            name: pool.submit(_job, *jobs[name]).result if pool else partial(_job, *jobs[name])
            for name in longest_first
        }
        for k, name in enumerate(names):
            self._tell(f"round {index + 1}: {name}", (index + k / len(jobs)) / MOST_ROUNDS)
            result = calls[name]()
            found |= {} if result is None else {name: result}
        return found

    def pool_of(self) -> AbstractContextManager[Executor | None]:
        """Who makes the calls; None for this process itself."""
        if self.executor is not None or self.workers < 2:
            return nullcontext(self.executor)
        return ProcessPoolExecutor(
            self.workers, get_context("fork"), initializer=tie_to, initargs=(os.getpid(),)
        )


def _cost(key: str, one: Screen) -> float:
    """What a screen leaves with a candidate in it."""
    return score(one.with_candidate(key)).cost


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
        found = refit(current.fit, name, values, noise_scales, colour)
    except ValueError:
        return None
    return fully(found, name, noise_scales, colour)


def _of_set(
    found: Refit, key: str, places: Places, values: dict[str, Array], noise_scales: Array
) -> Refit | None:
    try:
        return exchanged(found.fit, key, places, values, noise_scales)
    except ValueError:
        return None
