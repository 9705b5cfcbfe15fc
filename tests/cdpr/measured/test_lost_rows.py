"""Rows that were lost while the stamps were counted on, on both sides of each limit."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.cdpr.measured.lost_rows import lost_rows
from freeswing.cdpr.measured.trajectory import Trajectory

COUNT = 400
USUAL = 4.0 * 1.4826  # of steps that alternate by 2 about their mean


def straight(speed: float, times: float = 2.0, aside: float = 0.0, then: float = 0.0):
    """Positions along x with every step off by 2 to and fro; one is `times` as long as others.

    That one goes `aside` as well, and from it on all steps are longer by `then`.
    """
    steps = np.full((COUNT - 1, 2), [speed, 0.0])
    steps += 2.0 * (-1.0) ** np.arange(COUNT - 1)[:, None]
    steps[200] = [times * speed, aside * speed]
    steps[201:, 0] += then * speed
    values = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    return Trajectory(np.arange(COUNT) / 100.0, ("x", "y"), values)


@pytest.mark.parametrize(("clear", "is_lost"), [(6.5, True), (6.2, False)])
def test_steps_have_to_stand_out(clear, is_lost) -> None:
    assert bool(len(lost_rows(straight(clear * USUAL, 2.0)))) == is_lost


@pytest.mark.parametrize(
    ("times", "is_lost"),
    [(2.0, True), (3.0, True), (2.23, True), (2.27, False), (1.77, True), (1.73, False)],
)
def test_twice_or_three_times_as_long(times, is_lost) -> None:
    found = lost_rows(straight(1e4, times))
    assert found.tolist() == ([2.01] if is_lost else [])


@pytest.mark.parametrize(("aside", "is_lost"), [(0.23, True), (0.27, False)])
def test_along_the_line_of_those_around(aside, is_lost) -> None:
    assert bool(len(lost_rows(straight(1e4, 2.0, aside)))) == is_lost


@pytest.mark.parametrize(("then", "is_lost"), [(0.4, True), (0.75, False)])
def test_between_steps_that_agree(then, is_lost) -> None:
    """A knock leaves other speeds behind."""
    assert bool(len(lost_rows(straight(1e4, 2.0 + then, then=then)))) == is_lost


@pytest.mark.parametrize(("longer", "is_lost"), [(1.0, False), (0.32, False), (0.28, True)])
def test_a_gap_in_the_stamps_is_none(longer, is_lost) -> None:
    made = straight(1e4)
    times = made.times_s.copy()
    times[201:] += 0.01 * longer
    assert bool(len(lost_rows(Trajectory(times, made.coordinates, made.values)))) == is_lost


@pytest.mark.parametrize(("count", "is_lost"), [(20, False), (22, True)])
def test_few_samples_tell_nothing(count, is_lost) -> None:
    made = straight(1e4)
    few = made.take(np.arange(190, 190 + count))
    assert bool(len(lost_rows(few))) == is_lost


def test_a_copy_and_what_follows_it_are_none() -> None:
    """It stands still once and catches up: nothing was lost."""
    made = straight(1e4)
    values = made.values - made.values[201] + made.values[200]
    values[:201] = made.values[:201]
    values[100] = values[99]
    assert len(lost_rows(Trajectory(made.times_s, made.coordinates, values))) == 0
