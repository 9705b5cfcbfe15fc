"""The search for the least cost, on problems of two numbers whose answer is known."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.descent import STUCK
from freeswing.ident.likelihood.joint_problem import State, Step
from freeswing.ident.likelihood.minimise import minimised


@dataclass
class Valley:
    """Residuals (m,) of two numbers with their slopes, in the shape of `Problem`."""

    residuals: Any
    slopes: Any
    linearised: int = 0
    moves: int = 0
    most: list[float] = field(default_factory=list)

    def begun(self, state: State) -> State:
        return state

    rescaled = begun

    def cost(self, state: State) -> float:
        return float(np.sum(self.residuals(*state.values) ** 2))

    def linear(self, state: State) -> Any:
        self.linearised += 1
        return Known(self.residuals(*state.values), self.slopes(*state.values))

    def step(self, state: State, linear: Any, damping: float) -> Step:
        left, sizes, right = np.linalg.svd(linear.slopes, full_matrices=False)
        along = left.T @ linear.residuals
        gains = sizes / (sizes**2 + damping * sizes[0] ** 2)
        change = -right.T @ (gains * along)
        longest = float(np.abs(change).max())
        return Step(
            change, (), (), np.eye(2), sizes, 2, float(along @ along), longest, (), np.eye(2)
        )

    def moved(self, state: State, step: Step, near: Any, most: float) -> State | None:
        self.moves += 1
        self.most.append(most)
        values = state.values + step.shared
        return replace(state, values=values) if np.isfinite(values).all() else None


@dataclass
class Known:
    residuals: Any
    slopes: Any
    surroundings: tuple[()] = ()


def started(*values: float) -> State:
    return State(np.zeros(9), np.array(values), np.zeros((0, 12)), np.ones(2))


def rosenbrock() -> Valley:
    return Valley(
        lambda x, y: np.array([1e3 * (y - x * x), 1.0 - x]),
        lambda x, y: np.array([[-2e3 * x, 1e3], [-1.0, 0.0]]),
    )


def test_a_step_that_climbs_out_of_a_curved_valley_stands_when_it_leads_on() -> None:
    """Rosenbrock: the full step raises the cost a million times, the next one ends at 1, 1."""
    valley = rosenbrock()
    state, _, taken, stop = minimised(valley, started(-1.2, 1.44), 30, 1e-6)  # type: ignore[arg-type]
    np.testing.assert_allclose(state.values, [1.0, 1.0], atol=1e-9)
    assert stop.converged, stop
    assert (taken, valley.linearised) == (3, 3)


def test_what_does_not_lead_on_is_damped_and_ends_no_worse() -> None:
    """Arctan beyond 1.39: full steps overshoot further and further."""
    valley = Valley(
        lambda x, y: np.array([np.arctan(x), y]),
        lambda x, y: np.array([[1.0 / (1.0 + x * x), 0.0], [0.0, 1.0]]),
    )
    state, _, _, stop = minimised(valley, started(3.0, 0.5), 60, 1e-8)  # type: ignore[arg-type]
    np.testing.assert_allclose(state.values, [0.0, 0.0], atol=1e-3)
    assert stop.converged, stop
    # A full step may climb; a damped one is of no use above the best cost there is.
    assert valley.most[0] == np.inf
    assert valley.cost(started(3.0, 0.5)) in valley.most


@pytest.mark.parametrize(("start", "most"), [((0.7, 0.1), 2), ((1.0, 1.0), 1)])
def test_a_linear_problem_takes_one_step_and_what_is_solved_none(
    start: tuple[float, float], most: int
) -> None:
    valley = Valley(lambda x, y: np.array([x - 1.0, y - 1.0]), lambda x, y: np.eye(2))
    state, _, _, stop = minimised(valley, started(*start), 30, 0.01)  # type: ignore[arg-type]
    np.testing.assert_allclose(state.values, [1.0, 1.0], atol=1e-12)
    assert stop.converged, stop
    assert valley.linearised == most
    assert valley.moves == most - 1


def test_where_nothing_lowers_the_cost_it_says_so() -> None:
    valley = Valley(
        lambda x, y: np.array([1.0 + x * x, y]), lambda x, y: np.array([[1e-3, 0], [0, 1]])
    )
    state, _, _, stop = minimised(valley, started(0.0, 0.0), 60, 1e-8)  # type: ignore[arg-type]
    assert stop is STUCK
    assert np.abs(state.values).max() < 1e-3


@dataclass
class Told:
    """A problem whose costs and lengths of undamped steps are told; damped ones lead nowhere.

    Each step promises as much as it changes, but for the first one where that is told.
    """

    costs: list[float]
    lengths: list[float]
    first: float | None = None
    damped: int = 0

    def begun(self, state: State) -> State:
        return state

    rescaled = begun

    def cost(self, state: State) -> float:
        return self.costs[int(state.values[0])]

    def linear(self, state: State) -> Any:
        return Known(None, None)

    def step(self, state: State, linear: Any, damping: float) -> Step:
        place = int(state.values[0])
        changes = [*np.abs(np.diff(self.costs)), 0.0]
        left = self.first if self.first and not place else float(changes[place])
        self.damped += damping > 0.0
        length = self.lengths[min(place, len(self.lengths) - 1)]
        return Step(np.ones(1), (), (), np.eye(1), np.ones(1), 1, left, length, (), np.eye(1))

    def moved(self, state: State, step: Step, near: Any, most: float) -> State | None:
        return None if self.damped else replace(state, values=state.values + step.shared)


@pytest.mark.parametrize(
    ("costs", "lengths", "arrives"),
    [
        ([10.0, 11.0, 12.0, 13.0, 1.0], [1.0, 0.9, 0.8, 0.7, 0.6], True),
        ([10.0, 11.0, 12.0, 13.0, 14.0, 1.0], [1.0, 0.9, 0.8, 0.7, 0.6, 0.5], False),
        ([10.0, 11.0, 1.0], [1.0, 0.94, 0.5], True),
        ([10.0, 11.0, 1.0], [1.0, 0.96, 0.5], False),
    ],
)
def test_a_search_climbs_three_steps_while_they_become_shorter(
    costs: list[float], lengths: list[float], arrives: bool
) -> None:
    told = Told(costs, lengths)
    state, _, _, stop = minimised(told, started(0.0), 60, 0.01)  # type: ignore[arg-type]
    assert told.cost(state) == (1.0 if arrives else 10.0)
    assert (told.damped == 0) == arrives
    assert stop.converged == arrives


@pytest.mark.parametrize(("left", "foreseen"), [(0.9, True), (1.1, False)])
def test_a_search_that_foresees_ends_where_all_that_is_left_is_negligible(
    left: float, foreseen: bool
) -> None:
    """Each step leaves a tenth of the gain before: 100, 10, 1, 0.1 ..; after the second 1.11."""
    gains = 100.0 * 0.1 ** np.arange(8)
    costs = [*(np.cumsum(gains[::-1])[::-1]), 0.0]
    tolerance = gains[1] ** 2 / (gains[0] - gains[1]) / left
    for foresees, places in ((False, 3), (True, 2 if foreseen else 3)):
        told = Told(costs, [1.0])
        search = minimised(told, started(0.0), 8, tolerance, foresees)  # type: ignore[arg-type]
        assert search[0].values[0] == places
        assert search[3].converged


def test_a_gain_after_a_smaller_one_foresees_nothing() -> None:
    told = Told([200.0, 199.0, 100.0, 50.0, 1.0, 1.0], [1.0])
    state, *_ = minimised(told, started(0.0), 8, 1e-3, True)  # type: ignore[arg-type]
    assert told.cost(state) == 1.0


@pytest.mark.parametrize(("promised", "goes_on"), [(9.0, False), (11.0, True)])
@pytest.mark.parametrize("change", [-0.3, 0.3])
def test_a_step_that_ends_as_high_as_it_began_by_chance_is_not_the_last(
    promised: float, goes_on: bool, change: float
) -> None:
    """A step along a marker's offset promised 974, raised the cost by 0.3, and the next led on."""
    told = Told([1000.0, 1000.0 + change, 1.0], [1.0, 0.1], promised)
    state, _, _, stop = minimised(told, started(0.0), 8, 1.0)  # type: ignore[arg-type]
    assert (told.cost(state) == 1.0) == goes_on
    assert stop.converged
