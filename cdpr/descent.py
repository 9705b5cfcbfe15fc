"""Down a sum of squares: every search's loop, and one vocabulary of why it ended.

A step is tried; where it lowers the cost it stands and the damping eases, else the damping grows
(Levenberg 1944, Marquardt 1963; Nocedal and Wright, Numerical Optimization, 2006, sec. 10.3). What
the normal equations look like, and when enough is gained, is the problem's own affair.

Where a good step may raise the cost for once, as in a curved valley, `Watchdog` lets it stand if
the next one is shorter (natural monotonicity: Deuflhard, Newton Methods for Nonlinear Problems,
2011, sec. 4.3), for a few steps (a watchdog: Nocedal and Wright, sec. 15.6); else it goes back to
the best place and damps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol, TypeVar, cast

# Times the tolerance: a step that promised so much and brought nothing has failed, not converged.
BROKEN = 10.0


@dataclass(frozen=True, slots=True)
class Stop:
    """Why a search ended.

    Attributes:
        converged: whether it is because nothing is to be gained any more.
        sentence: for people.
    """

    converged: bool
    sentence: str

    def __str__(self) -> str:
        return self.sentence


CONVERGED = Stop(True, "converged")
AT_ROUNDING = Stop(True, "converged to rounding")
STUCK = Stop(False, "stopped: no step lowers the cost")
UNSOLVABLE = Stop(False, "stopped: the normal equations cannot be solved")


def converged(what: str) -> Stop:
    """Converged, and by what it shows."""
    return Stop(True, f"converged: {what}")


def out_of_steps(steps: int) -> Stop:
    """Not converged after all the steps that there were."""
    return Stop(False, f"stopped after {steps} steps")


class Place(Protocol):
    """Where a search stands."""

    @property
    def cost(self) -> float:
        """Half the sum of squares there."""
        ...


class Step(Protocol):
    """A step away from a place."""

    @property
    def promised(self) -> float:
        """By what it lowers the cost, to first order."""
        ...


class LongStep(Step, Protocol):
    """A step whose length is known."""

    @property
    def longest(self) -> float:
        """Largest change of an unknown, in its scale."""
        ...


P = TypeVar("P", bound=Place)
S = TypeVar("S", bound=Step)
L = TypeVar("L", bound=LongStep)


class Problem(Protocol[P, S]):
    """What is searched."""

    def step(self, place: P, damping: float) -> S | None:
        """A damped step; None where the normal equations have no solution."""
        ...

    def moved(self, place: P, step: S) -> P | None:
        """The place after a step; None where nothing can be computed."""
        ...

    def ended(self, place: P, step: S, trial: P | None, lower: bool, damping: float) -> Stop | None:
        """Whether a step to `trial`, which is `lower` or not, is the last; and why."""
        ...


@dataclass(frozen=True, slots=True)
class Damping:
    """How much a step is damped.

    Attributes:
        first: at the start, of a column's own curvature.
        ease: factor after a step that lowers the cost.
        least: it eases no further.
        growth: factor after a step that does not.
        faster: factor on that factor, from one such step to the next.
        largest: from here on a step is too small to lower anything.
    """

    first: float = 1e-4
    ease: float = 0.1
    least: float = 1e-12
    growth: float = 10.0
    faster: float = 1.0
    largest: float = 1e100

    def eased(self, damping: float, ratio: float) -> float:
        """After a step that lowered the cost by `ratio` times what it promised."""
        return max(damping * self.ease, self.least)

    def grown(self, damping: float, growth: float) -> float:
        """After a step that did not lower it."""
        return damping * growth

    def is_hopeless(self, damping: float, growth: float) -> bool:
        """Whether no further step is worth a trial after one that failed."""
        return damping > self.largest


@dataclass(frozen=True, slots=True)
class Undamped(Damping):
    """None until a step fails (Gauss and Newton), and none again where it has eased.

    Attributes:
        first: before any step has failed.
        raised: after the first that has.
        relief: divisor after a step that lowers the cost.
        least: below it there is none.
    """

    first: float = 0.0
    raised: float = 1e-4
    relief: float = 3.0

    def eased(self, damping: float, ratio: float) -> float:
        """After a step that lowered the cost."""
        return 0.0 if damping < self.least else damping / self.relief

    def grown(self, damping: float, growth: float) -> float:
        """After a step that did not lower it."""
        return max(self.raised, growth * damping)

    def is_hopeless(self, damping: float, growth: float) -> bool:
        """Whether no further step is worth a trial after one that failed."""
        return self.grown(damping, growth) > self.largest


@dataclass(frozen=True, slots=True)
class Nielsen(Damping):
    """Eased as far as the step kept its promise (Nielsen, IMM-REP-1999-05, sec. 2)."""

    def eased(self, damping: float, ratio: float) -> float:
        """After a step that lowered the cost by `ratio` times what it promised."""
        return max(damping * max(self.ease, 1.0 - (2.0 * ratio - 1.0) ** 3), self.least)


@dataclass(frozen=True, slots=True)
class LevenbergMarquardt:
    """The search.

    Attributes:
        steps: at most so many.
        damping: how it is damped.
        level: whether a step that leaves the cost as it is stands too.
        slack: by what share of the cost such a step may raise it: rounding.
        farthest: longer steps are damped before they are tried; only for steps that are `LongStep`.
    """

    steps: int
    damping: Damping = Damping()
    level: bool = False
    slack: float = 0.0
    farthest: float = math.inf

    def descend(self, problem: Problem[P, S], place: P) -> tuple[P, int, Stop]:
        """The lowest place found from a start, how many steps were tried, and why it ended."""
        damping, growth = self.damping.first, self.damping.growth
        for count in range(1, self.steps + 1):
            step, damping = self._short(problem, place, damping)
            if step is None:
                return place, count, UNSOLVABLE
            trial = problem.moved(place, step)
            lower = trial is not None and self._is_lower(trial.cost, place.cost)
            stop = problem.ended(place, step, trial, lower, damping)
            if trial is not None and lower:
                ratio = (place.cost - trial.cost) / max(step.promised, 1e-300)
                damping, growth = self.damping.eased(damping, ratio), self.damping.growth
                place = trial
            elif stop is None and self.damping.is_hopeless(damping, growth):
                stop = STUCK
            else:
                damping = self.damping.grown(damping, growth)
                growth = growth * self.damping.faster
            if stop is not None:
                return place, count, stop
        return place, self.steps, out_of_steps(self.steps)

    def _short(self, problem: Problem[P, S], place: P, damping: float) -> tuple[S | None, float]:
        """A step no longer than the longest, and how it is damped."""
        step = problem.step(place, damping)
        if math.isinf(self.farthest):
            return step, damping
        while (
            step is not None
            and cast(LongStep, step).longest > self.farthest
            and damping < self.damping.largest
        ):
            damping = self.damping.grown(damping, self.damping.growth)
            step = problem.step(place, damping)
        return step, damping

    def _is_lower(self, trial: float, here: float) -> bool:
        return trial <= here * (1.0 + self.slack) if self.level else trial < here


class Valley(Protocol[P, L]):
    """What is searched with a watchdog."""

    def step(self, place: P, damping: float) -> L:
        """A damped step."""
        ...

    def moved(self, place: P, step: L, most: float) -> P | None:
        """The place after a step; None where nothing can be computed, or it costs more than most.

        What costs more need not be known to its end.
        """
        ...

    def settled(self, place: P) -> P:
        """A place that the search goes on from, its noise as its residuals show it."""
        ...


@dataclass(frozen=True, slots=True)
class Watchdog:
    """The search that may climb.

    Attributes:
        steps: at most so many.
        tolerance: converged when an undamped step lowers the cost by less, as it promises or does.
        damping: how it is damped once a step has failed.
        shorter: than the last step is the next one where a climb leads on.
        most_rises: steps above the best cost, until it has to be beaten.
        negligible: share of the tolerance that is not worth a trial.
        foresees: whether it ends as well where all steps to come would lower the cost by less than
            the tolerance, each by the share of the one before that the last one did.
    """

    steps: int
    tolerance: float
    damping: Undamped
    shorter: float
    most_rises: int
    negligible: float
    foresees: bool = False

    def descend(self, problem: Valley[P, L], place: P) -> tuple[P, L, int, Stop]:
        """The lowest place found, the step to it, how many were tried, and why it ended."""
        here = best = problem.settled(place)
        damping, rises, taken, falls, before = 0.0, 0, 0, False, 0.0
        stop = out_of_steps(self.steps)
        for taken in range(1, self.steps + 1):
            step = problem.step(here, damping)
            if falls and damping > 0.0 and step.promised < self.tolerance:
                damping, step = 0.0, problem.step(here, 0.0)
            promised = step.promised if damping == 0.0 else math.inf
            if promised < self.negligible * self.tolerance and here is best:
                return best, step, taken, _gained(promised)
            # A damped step that climbs leads nowhere, wherever it ends.
            trial = problem.moved(here, step, math.inf if damping == 0.0 else best.cost)
            gain = -math.inf if trial is None else best.cost - trial.cost
            full = damping == 0.0 and here is best
            if trial is not None and (
                self._ends(promised, gain, full) or self._foreseen(before, gain, full)
            ):
                kept = problem.settled(trial) if gain >= 0.0 else best
                return kept, step, taken, _gained(gain)
            falls, before = gain > 0.0, gain if full else 0.0
            if trial is not None and falls:
                here = best = problem.settled(trial)
                damping, rises = self.damping.eased(damping, 1.0), 0
                continue
            may_climb = damping == 0.0 and rises < self.most_rises
            if trial is not None and may_climb and self._leads_on(problem, trial, step):
                here, rises = trial, rises + 1
                continue
            here, damping = best, self.damping.grown(damping, self.damping.growth)
            if damping > self.damping.largest:
                stop = STUCK
                break
        return best, problem.step(best, 0.0), taken, stop

    def _ends(self, promised: float, gain: float, full: bool) -> bool:
        """Whether nothing is to be gained any more, by what a step promised or a full one did.

        One that promised far more has gone too far: that it ends as high as it began is chance.
        """
        done = full and promised < BROKEN * self.tolerance
        return (promised < self.tolerance or done) and abs(gain) < self.tolerance

    def _foreseen(self, before: float, gain: float, full: bool) -> bool:
        """Whether the steps to come gain less than the tolerance, after two full ones that fell.

        Source:
            Deuflhard 2011, Newton Methods for Nonlinear Problems, sec. 4.3.1: a Gauss-Newton search
            converges linearly, the incompatibility factor being the ratio of its steps.
        """
        if not (self.foresees and full and before > gain > 0.0):
            return False
        return gain * gain / (before - gain) < self.tolerance

    def _leads_on(self, problem: Valley[P, L], trial: P, step: L) -> bool:
        return problem.step(trial, 0.0).longest < self.shorter * step.longest


def _gained(gain: float) -> Stop:
    return converged(f"the last step lowered the cost by {max(gain, 0.0):.2g}")
