"""Nothing is refused as "none of these" before what the screen does not exclude was fitted."""

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.ident.diagnose import decision as rules
from freeswing.ident.diagnose.decision import LEAST_GAIN, Decision, promising, settles
from freeswing.ident.diagnose.leave_one_out import Score
from tests.oracle.scenes.robots import declared_robot

NAMES = (
    "translational_drag", "rotational_drag", "quadratic_drag", "swivel_viscous", "torsion_spring",
    "constant_force", "gravity_tilt",
)  # fmt: skip
ONE = np.ones(2)


@pytest.fixture(autouse=True)
def moves_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is missing moves all numbers of a run."""
    monkeypatch.setattr(
        rules, "independent_numbers", lambda fit, _: np.full(len(fit.samples), 250.0)
    )


def scored(held_out):
    nothing = np.zeros(0)
    return Score(nothing, nothing, nothing, held_out, np.full(4, held_out / 4.0), np.zeros(4), 0)


def current_fit(held_out=10000.0, count=1000.0):
    fit = SimpleNamespace(
        model=SimpleNamespace(robot=declared_robot("three-cable")), samples=[None] * 4
    )
    evidence = SimpleNamespace(counts=np.full(4, count / 4.0))
    score = scored(held_out)
    return SimpleNamespace(fit=fit, evidence=evidence, score=score, held_out=held_out)


def ranking(gains):
    return {name: scored(10000.0 - gain) for name, gain in zip(NAMES, gains, strict=True)}


def test_first_those_near_the_best_then_all_that_promise_anything():
    gains = (9000.0, 8000.0, 7000.0, 6000.0, 5000.0, 2000.0, LEAST_GAIN / 2.0)
    linear, current = ranking(gains), current_fit()
    first = promising(current, linear, 1.0, ONE)  # pyright: ignore[reportArgumentType]
    assert first == list(NAMES[:5]), first
    second = promising(current, linear, 1.0, ONE, first)  # pyright: ignore[reportArgumentType]
    assert second == list(NAMES[5:6]), second
    assert promising(current, linear, 1.0, ONE, [*first, *second]) == []  # pyright: ignore[reportArgumentType]


def test_a_winner_that_leaves_much_unexplained_does_not_end_the_search():
    current = current_fit()
    for left, enough in ((1004.0, True), (2500.0, True), (4000.0, False)):
        winner = SimpleNamespace(
            held_out=left, evidence=current.evidence, fit=current.fit, score=scored(left)
        )
        decision = Decision((), winner, NAMES[0], (NAMES[0],))  # pyright: ignore[reportArgumentType]
        assert settles(decision, current, ONE) is enough, left  # pyright: ignore[reportArgumentType]
    assert not settles(Decision(()), current, ONE)  # pyright: ignore[reportArgumentType]
