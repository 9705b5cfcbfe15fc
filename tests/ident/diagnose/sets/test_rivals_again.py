"""Groups that a round could not tell apart, asked again beside what came later."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.ident.diagnose.decision import Candidate, Decision
from freeswing.ident.diagnose.search import Round, Search
from freeswing.ident.diagnose.sets import rivals_again as room
from freeswing.ident.diagnose.sets.rivals_again import asked_again

TILT, TETHER, STRETCH = "gravity_tilt", "tether", "cable_elasticity"


def fitted(name: str, gain: float = 0.0) -> Any:
    fit = SimpleNamespace(values=np.zeros(3), name=name)
    return SimpleNamespace(
        name=name, fit=fit, score=gain, effects=(name,), values_of=lambda _: slice(0, 3)
    )


def two_rounds() -> list[Decision]:
    """A tether that leads a tilt, and what was found after them."""
    words = (
        Candidate(TETHER, "confounded", -90.0, 1.0, (TILT,), "cannot tell", 0.3),
        Candidate(TILT, "confounded", -80.0, 0.9, (TETHER,), "cannot tell", 0.7),
        Candidate(STRETCH, "rejected", 0.0, 0.0, (), "removes nothing"),
    )
    rival = fitted(TILT)
    group = Decision(words, fitted(TETHER), TETHER, (TETHER, TILT), rival, others={TILT: rival})
    return [group, Decision((), fitted(STRETCH), STRETCH, (STRETCH,))]


@pytest.fixture
def ask(monkeypatch):
    """Asks a group again: who leads then, with which probabilities and gains of runs left out."""

    def asking(key: str, chances: dict[str, float], gains: dict[str, float], follows: bool = True):
        def exchanged(found, leader, places, values, scales):
            if not follows:
                raise ValueError("no motion")
            assert (leader, set(values)) == (TETHER, {TILT})
            return fitted(places[0], gains[TILT])

        def decided(fewer, linear, tried, *_):
            words = [Candidate(n, "rejected", 0.0, 0.0, (), "", chances[n]) for n in tried]
            return Decision(tuple(words), tried.get(key), key, (key,))

        monkeypatch.setattr(room, "exchanged", exchanged)
        monkeypatch.setattr(room, "decided", decided)
        monkeypatch.setattr(room, "without", lambda *_: fitted("fewer"))
        monkeypatch.setattr(room, "colour_of", lambda *_: 1.0)
        runs = SimpleNamespace(gains=lambda score: np.array([score]))
        monkeypatch.setattr(room, "left_out", lambda *_: runs)
        return asked_again(two_rounds(), fitted("last", gains[TETHER]), np.ones(2))

    return asking


@pytest.mark.parametrize(("chance", "stays"), [(0.06, True), (0.04, False)])
def test_a_rival_that_is_improbable_beside_all_that_was_found_is_none(ask, chance, stays) -> None:
    """A tilt of 3.5 mrad and a tether, told apart once the cables' stretch was in the model."""
    chances = {TILT: 1.0 - chance, TETHER: chance}
    (first, second), last = ask(TILT, chances, {TILT: 9.0, TETHER: 8.0})
    assert (first.key, first.group) == (TILT, (TILT, TETHER) if stays else (TILT,))
    assert second.key == STRETCH
    assert last.name == TILT
    verdicts = {one.effect: one.verdict for one in first.candidates}
    expected = ("confounded", "confounded") if stays else ("accepted", "rejected")
    assert (verdicts[TILT], verdicts[TETHER]) == expected
    assert verdicts[STRETCH] == "rejected"
    assert (first.rival is not None) == stays


@pytest.mark.parametrize(("gain", "stays"), [(9.1, True), (8.9, False)])
def test_a_rival_that_predicts_runs_left_out_better_stays_one(ask, gain, stays) -> None:
    (first, _), last = ask(TETHER, {TILT: 0.01, TETHER: 0.99}, {TILT: gain, TETHER: 9.0})
    assert first.group == ((TETHER, TILT) if stays else (TETHER,))
    assert last.name == "last"


def test_groups_stay_where_nothing_is_named_or_the_rival_cannot_be_followed(ask) -> None:
    chances, gains = {TILT: 0.01, TETHER: 0.01}, {TILT: 0.0, TETHER: 9.0}
    (first, _), last = ask("", chances, gains)
    assert (first.key, first.group, last.name) == (TETHER, (TETHER, TILT), "last")
    (first, _), last = ask(TETHER, chances, gains, follows=False)
    assert (first.group, last.name) == ((TETHER, TILT), "last")


@pytest.mark.parametrize(("excess", "asked"), [(0.4, True), (0.6, False)])
def test_groups_are_asked_again_once_nothing_else_is_missing(monkeypatch, excess, asked) -> None:
    module = "freeswing.ident.diagnose.search."
    monkeypatch.setattr(module + "excess_of", lambda _: excess)
    monkeypatch.setattr(module + "asked_again", lambda told, last, _: (told[::-1], "another"))
    search = Search(np.ones(2), ())
    search.rounds = [Round(None, one) for one in (*two_rounds(), Decision(()))]
    assert search._asked_again("last") == ("another" if asked else "last")
    keys = [TETHER, STRETCH, ""]
    assert [one.decision.key for one in search.rounds] == ([STRETCH, TETHER, ""] if asked else keys)
