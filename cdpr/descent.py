"""Down a sum of squares: one loop after Levenberg and Marquardt, one vocabulary of why it ended.

A step is tried; where it lowers the cost it stands and the damping eases, else the damping grows
(Levenberg 1944, Marquardt 1963; Nocedal and Wright, Numerical Optimization, 2006, sec. 10.3). What
the normal equations look like, and when enough is gained, is the problem's own affair.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeVar


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


P = TypeVar("P", bound=Place)
S = TypeVar("S", bound=Step)


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
    """

    steps: int
    damping: Damping = Damping()
    level: bool = False

    def descend(self, problem: Problem[P, S], place: P) -> tuple[P, int, Stop]:
        """The lowest place found from a start, how many steps were tried, and why it ended."""
        damping, growth = self.damping.first, self.damping.growth
        for count in range(1, self.steps + 1):
            step = problem.step(place, damping)
            if step is None:
                return place, count, UNSOLVABLE
            trial = problem.moved(place, step)
            lower = trial is not None and self._is_lower(trial.cost, place.cost)
            stop = problem.ended(place, step, trial, lower, damping)
            if trial is not None and lower:
                ratio = (place.cost - trial.cost) / max(step.promised, 1e-300)
                damping, growth = self.damping.eased(damping, ratio), self.damping.growth
                place = trial
            elif stop is None and damping > self.damping.largest:
                stop = STUCK
            else:
                damping, growth = damping * growth, growth * self.damping.faster
            if stop is not None:
                return place, count, stop
        return place, self.steps, out_of_steps(self.steps)

    def _is_lower(self, trial: float, here: float) -> bool:
        return trial <= here if self.level else trial < here
