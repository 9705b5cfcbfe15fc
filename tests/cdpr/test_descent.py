"""One loop down a sum of squares: where it goes, how it is damped, why it says it ended."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from freeswing.cdpr.descent import (
    CONVERGED,
    STUCK,
    UNSOLVABLE,
    Damping,
    LevenbergMarquardt,
    Nielsen,
    Stop,
)


@dataclass(frozen=True)
class At:
    x: float
    cost: float


@dataclass(frozen=True)
class Step:
    change: float
    promised: float


@dataclass
class Valley:
    """Half the square of a residual of one number; `wall`: beyond it nothing can be computed."""

    residual: object
    slope: object
    wall: float = np.inf
    gain: float = 1e-12

    def __post_init__(self) -> None:
        self.dampings: list[float] = []

    def at(self, x: float) -> At:
        return At(x, 0.5 * self.residual(x) ** 2)

    def step(self, place: At, damping: float) -> Step | None:
        self.dampings.append(damping)
        slope, residual = self.slope(place.x), self.residual(place.x)
        curve = slope * slope * (1.0 + damping)
        if not curve > 0.0:
            return None
        change = -slope * residual / curve
        return Step(change, -0.5 * slope * residual * change)

    def moved(self, place: At, step: Step) -> At | None:
        x = place.x + step.change
        return self.at(x) if abs(x) < self.wall else None

    def ended(self, place: At, step: Step, trial: At | None, lower: bool, damping: float):
        return CONVERGED if trial is not None and step.promised < self.gain else None


def test_a_line_takes_a_step_and_one_that_says_so() -> None:
    valley = Valley(lambda x: 2.0 * (x - 3.0), lambda x: 2.0)
    solver = LevenbergMarquardt(20, Damping(first=0.0))
    place, count, stop = solver.descend(valley, valley.at(0.0))
    assert (place.x, count, stop) == (pytest.approx(3.0, abs=1e-12), 2, CONVERGED)


def test_steps_too_far_are_damped_and_good_ones_ease_it() -> None:
    """Arctan beyond 1.39: the full step overshoots further and further, and then leaves the map."""
    valley = Valley(np.arctan, lambda x: 1.0 / (1.0 + x * x), wall=50.0)
    place, _, stop = LevenbergMarquardt(60).descend(valley, valley.at(10.0))
    assert stop.converged, stop
    assert abs(place.x) < 1e-5, place
    steps = np.array(valley.dampings)
    assert steps[1] == pytest.approx(10.0 * steps[0])
    assert steps[-1] < steps.max() / 100.0, steps


def test_why_it_ended_is_never_called_converged_where_it_is_not() -> None:
    """Nothing lowers the cost; the equations are singular; the steps have run out."""
    uphill = Valley(lambda x: 1.0 + x * x, lambda x: -1.0, gain=0.0)
    solver = LevenbergMarquardt(200, Damping(largest=1e8))
    place, _, stop = solver.descend(uphill, uphill.at(0.0))
    assert stop is STUCK
    assert place.x == 0.0
    flat = Valley(lambda x: 1.0, lambda x: 0.0)
    assert solver.descend(flat, flat.at(0.0))[2] is UNSOLVABLE
    slow = Valley(lambda x: x**8, lambda x: 8.0 * x**7, gain=0.0)
    stop = LevenbergMarquardt(5).descend(slow, slow.at(1.0))[2]
    assert stop == Stop(False, "stopped after 5 steps")
    assert not any(one.converged for one in (STUCK, UNSOLVABLE, stop))


def test_growth_gets_faster_and_starts_anew() -> None:
    uphill = Valley(lambda x: 1.0 + x * x, lambda x: -1.0, gain=0.0)
    LevenbergMarquardt(5, Damping(growth=4.0, faster=2.0)).descend(uphill, uphill.at(0.0))
    ratios = np.array(uphill.dampings[1:]) / np.array(uphill.dampings[:-1])
    assert ratios == pytest.approx([4.0, 8.0, 16.0, 32.0])


@pytest.mark.parametrize(("ratio", "factor"), [(1.0, 0.25), (0.5, 1.0), (0.1, 1.512)])
def test_nielsen_eases_as_far_as_the_promise_was_kept(ratio: float, factor: float) -> None:
    assert Nielsen(ease=0.25).eased(1e-2, ratio) == pytest.approx(1e-2 * factor)
    assert Nielsen(ease=0.25, least=1.0).eased(1e-2, ratio) == 1.0


def test_a_level_step_stands_only_where_that_is_wanted() -> None:
    """Over the ridge to the other side, at the same height."""
    valley = Valley(lambda x: abs(x) + 1.0, lambda x: 2.0 if x > 0 else -2.0, gain=0.0)
    valley.step = lambda place, damping: Step(-2.0 * place.x, 0.1)
    for level, x in ((True, -1.0), (False, 1.0)):
        solver = LevenbergMarquardt(1, level=level)
        assert solver.descend(valley, valley.at(1.0))[0].x == x
