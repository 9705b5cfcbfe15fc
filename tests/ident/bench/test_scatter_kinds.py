"""Scatter between runs that goes with what they carry is no scatter."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.ident.bench.told.scatter_by_kind import (
    by_kind,
    is_systematic,
    kinds,
    scatter_sentence,
)

KINDS = [0, 0, 0, 1, 1, 1, 2, 2, 2, 2]


def test_chance_is_called_systematic_as_often_as_it_may() -> None:
    """One time in twenty, of four thousand sessions of ten runs."""
    random = np.random.default_rng(0)
    sure = [by_kind(random.normal(size=10), KINDS) > 0.95 for _ in range(4000)]
    assert 0.04 < np.mean(sure) < 0.06, np.mean(sure)


def test_what_is_held_may_be_off_by_what_is_believed() -> None:
    """Drawn from a held number that answers to kinds: once in twenty; three times as far: seen."""
    random = np.random.default_rng(0)
    answer = 10.0 * np.array([0, 0, 0, 1, 1, 1, -0.4, -0.4, -0.4, -0.4])
    believed = np.outer(answer, answer)

    def sure(times: float) -> float:
        draws = random.normal(size=(4000, 1)) * times * answer + random.normal(size=(4000, 10))
        return float(np.mean([by_kind(one, KINDS, believed) > 0.95 for one in draws]))

    assert 0.02 < sure(1.0) < 0.06
    assert sure(10.0) > 0.7
    across = 10.0 * np.array([0, 0, 0, 0.4, 0.4, 0.4, 1, 1, 1, 1]) + random.normal(size=10)
    assert by_kind(across, KINDS, believed) > 0.95, "what it does not answer to is no part of it"


def test_kinds_that_stand_apart() -> None:
    values = np.array([-65.0, -62.0, 127.0, -2.0, 2.0])
    assert by_kind(values, [0, 0, 1, 2, 2]) > 0.99
    assert by_kind(values, [0, 1, 2, 3, 4]) == 0.0, "every run by itself tells nothing"
    assert by_kind(values, [0] * 5) == 0.0
    assert by_kind(np.array([1.0, 1.0, 2.0]), [0, 0, 1]) == 1.0


def swing(weight_kg: float, load: str = "") -> Any:
    riding = [SimpleNamespace(block="platform", turn=np.eye(3))]
    riding += [SimpleNamespace(block=load, turn=np.eye(3))] if load else []
    return SimpleNamespace(known=np.array([weight_kg, *np.zeros(9)]), riding=riding)


@pytest.mark.parametrize(("within", "systematic"), [(0.05, True), (1.0, False)])
def test_a_session_whose_scatter_goes_with_its_loads(within: float, systematic: bool) -> None:
    swings = [
        swing(0.0),
        swing(0.0),
        swing(0.4),
        swing(0.4),
        swing(0.0, "cube"),
        swing(0.0, "cube"),
    ]
    assert kinds(swings) == [0, 0, 1, 1, 2, 2]
    values = np.array([-1.0, -1.0, 1.0, 1.0, 0.0, 0.0]) + within * np.array([1, -1, 1, -1, 1, -1])
    unknowns = {"scatter": None}
    solution = SimpleNamespace(value=lambda _: values, unknowns=unknowns)
    solved: Any = SimpleNamespace(
        scatter_std=1e-4, solution=solution, swings=swings, held_scatter=None
    )
    assert is_systematic(solved) == systematic
    assert ("goes with what they carry" in scatter_sentence(solved)) == systematic
    solved.held_scatter = np.outer(values, values)
    assert not is_systematic(solved)
    solved.scatter_std = 0.0
    assert not is_systematic(solved)
    assert scatter_sentence(solved) == ""
