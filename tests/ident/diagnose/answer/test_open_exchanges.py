"""What may be there instead of an answer counts, however much of it was taken back."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.ident.diagnose.answer import open_exchanges as room
from freeswing.ident.diagnose.answer.open_exchanges import open_exchanges
from freeswing.ident.diagnose.decision import Decision
from freeswing.ident.diagnose.search import Round
from freeswing.ident.diagnose.sets.exchange import sentence
from freeswing.ident.diagnose.sets.ways import Exchange, Way

PAIR = ("anchor_offset:1", "cable_length_bias")
RIVAL = (Way(("pulley_axis",), 0.3, "axes"),)


def fit(name: str) -> SimpleNamespace:
    return SimpleNamespace(name=name, fit=name)


DECLARED, ONE, BOTH = fit("declared"), fit("one"), fit("both")
TOLD = Exchange(PAIR, 0.7, (ONE, BOTH), RIVAL)


def rounds() -> list[Round]:
    """A set of two places won, each with its round; nothing after it."""
    first = Round(DECLARED, Decision((), ONE, PAIR[0]))
    second = Round(ONE, Decision((), BOTH, PAIR[1], exchange=TOLD))
    return [first, second, Round(BOTH, Decision(()))]


def test_a_set_that_stands_is_told_as_it_was_found() -> None:
    done = rounds()
    assert open_exchanges(done, done[:2], np.ones(2)) == [TOLD]


def test_rivals_count_where_the_last_place_of_a_set_was_taken_back() -> None:
    """They had counted no more: the round that told of them was that place's."""
    done = rounds()
    (left,) = open_exchanges(done, done[:1], np.ones(2))
    assert (left.leader, left.fits, left.ways) == (PAIR[:1], (ONE,), RIVAL)
    assert "anchor_offset 1 (70 %) or pulley_axis (30 %)" in sentence(left)


def test_rivals_count_where_the_first_place_was_taken_back(monkeypatch) -> None:
    monkeypatch.setattr(room, "without", lambda one, name, _: fit(f"{one} without {name}"))
    done = rounds()
    (left,) = open_exchanges(done, done[1:2], np.ones(2))
    assert (left.leader, left.ways) == (PAIR[1:], RIVAL)
    assert left.fits[-1].fit == "both without anchor_offset"


@pytest.mark.parametrize(("later", "count"), [(False, 1), (True, 0)])
def test_a_set_that_is_not_told_counts_until_something_else_came(later: bool, count: int) -> None:
    done = [*rounds()[:2], Round(BOTH, Decision((), fit("more"), "gravity_tilt"))]
    found = open_exchanges(done, done[2:] if later else [], np.ones(2))
    assert len(found) == count
    ways = [way for one in found for way in one.ways]
    assert [(way.places, way.probability) for way in ways] == [(PAIR, 0.7), *RIVAL_TOLD][
        : 2 * count
    ]


RIVAL_TOLD = [(("pulley_axis",), 0.3)]


def test_what_was_never_sure_counts_in_the_last_round() -> None:
    unsure = Exchange((), 0.4, (BOTH,), (Way(("tether",), 0.6, "tether"),))
    done = [*rounds()[:2], Round(BOTH, Decision((), exchange=unsure))]
    assert open_exchanges(done, done[:2], np.ones(2)) == [TOLD, unsure]
