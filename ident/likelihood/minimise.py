"""Least squares over all runs: Gauss-Newton steps that may climb out of a curved valley.

Where a swing's decay is wrong, a good step raises the cost for once: what it leaves in the
directions that data see best is second order, and the next step takes it away. Hence the watchdog
of `cdpr.descent`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from freeswing.cdpr.descent import Stop, Undamped, Watchdog
from freeswing.ident.likelihood.joint_problem import FirstOrder, Problem, State, Step

FIRST_DAMPING = 1e-7  # of the largest curvature: below, a damped step is the full one
LARGEST_DAMPING = 1e2  # a step so damped goes nowhere
SHORTER = 0.95  # than the last step is the next one where the search converges
MOST_RISES = 3  # steps above the best cost, until it has to be beaten
NEGLIGIBLE = 1e-4  # of the tolerance: not worth a simulation


def minimised(
    problem: Problem, state: State, steps: int, tolerance: float, foresees: bool = False
) -> tuple[State, Step, int, Stop]:
    """The state of least cost, the step that led to it, how many were taken, and why it stopped.

    Of the step, what counts is its triangle.

    Args:
        problem: what is minimised.
        state: where to start; motions that belong to it are not simulated again.
        steps: at most so many.
        tolerance: converged when an undamped step lowers the cost by less, as it promises or does.
        foresees: or when the steps to come would, see `Watchdog`.

    Raises:
        ValueError: when the start cannot be simulated, naming the run.
    """
    damping = Undamped(
        raised=FIRST_DAMPING, relief=4.0, least=FIRST_DAMPING / 10.0, largest=LARGEST_DAMPING
    )
    search = Watchdog(steps, tolerance, damping, SHORTER, MOST_RISES, NEGLIGIBLE, foresees)
    runs = _Runs(problem)
    place, step, taken, stop = search.descend(runs, runs.at(problem.begun(state)))
    return place.state, step, taken, stop


@dataclass(frozen=True)
class _Place:
    """A state; its cost and all runs to first order once they are asked for."""

    problem: Problem
    state: State

    @property
    def cost(self) -> float:
        return self._cost

    @cached_property
    def _cost(self) -> float:
        return self.problem.cost(self.state)

    @cached_property
    def linear(self) -> FirstOrder:
        return self.problem.linear(self.state)


@dataclass(frozen=True, slots=True)
class _Runs:
    """The joint problem as the search sees it."""

    problem: Problem

    def at(self, state: State) -> _Place:
        return _Place(self.problem, state)

    def step(self, place: _Place, damping: float) -> Step:
        return self.problem.step(place.state, place.linear, damping)

    def moved(self, place: _Place, step: Step, most: float) -> _Place | None:
        around = place.linear.surroundings
        state = self.problem.moved(place.state, step, around, most)
        return None if state is None else _Place(self.problem, state)

    def settled(self, place: _Place) -> _Place:
        state = self.problem.rescaled(place.state)
        return place if state is place.state else replace(place, state=state)
