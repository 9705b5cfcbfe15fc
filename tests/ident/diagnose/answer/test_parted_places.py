"""Which of the places that lengths cannot tell apart is told once nothing else is missing."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.ident.diagnose.answer import parted_places as module
from freeswing.ident.diagnose.answer import taken_back
from freeswing.ident.diagnose.decision import Candidate, Decision
from freeswing.ident.diagnose.search import Round

NAMES = ("anchor_offset", "attachment_offset")


def settled(by_lengths: bool = True) -> Any:
    words = tuple(
        Candidate(name, verdict, -9.0, 0.9, tuple(n for n in NAMES if n != name), "lengths", 0.5)
        for name, verdict in zip(NAMES, ("accepted", "confounded"), strict=True)
    )
    before: Any = "before"
    return Round(before, Decision(words, None, NAMES[0], NAMES), by_lengths=by_lengths)


def told(monkeypatch, chances, no_worse, by_lengths=True, in_model=NAMES) -> list[Round]:
    """Chances that each is nothing, and whether the model is as good without it."""
    monkeypatch.setattr(
        module, "chance_of_nothing", lambda final, spread, name: chances[NAMES.index(name)]
    )
    monkeypatch.setattr(module, "without", lambda fit, name, scales: name)
    monkeypatch.setattr(
        module, "is_no_worse", lambda fewer, last, name, scales: no_worse[NAMES.index(name)]
    )
    final: Any = SimpleNamespace(model=SimpleNamespace(effects=in_model))
    last: Any = SimpleNamespace(fit=None)
    return module.parted([settled(by_lengths)], last, final, np.eye(1), np.ones(2))


@pytest.mark.parametrize("nothing", [0.06, 0.9])
def test_the_place_that_motions_say_is_off_leads_alone(monkeypatch, nothing) -> None:
    """An anchor of (0.00 0.02 0.05) +- 0.08 mm beside an attachment of 5.00 +- 0.02 mm."""
    (one,) = told(monkeypatch, (nothing, 1e-9), (True, False))
    assert (one.decision.key, one.decision.group) == (NAMES[1], (NAMES[1],))
    first, other = one.decision.candidates
    assert (first.effect, first.verdict, first.confounded_with) == (NAMES[1], "accepted", ())
    assert (other.verdict, other.confounded_with) == ("rejected", ())
    assert NAMES[1] in other.reason


@pytest.mark.parametrize(
    ("chances", "no_worse"),
    [
        ((0.04, 1e-9), (True, False)),  # both have values
        ((0.3, 0.06), (True, True)),  # neither has: they say the same
        ((0.3, 1e-9), (False, False)),  # the model needs both
        ((0.3, 0.04), (True, True)),  # either may go
    ],
)
def test_places_stay_together_where_motions_are_not_sure_either(monkeypatch, chances, no_worse):
    (one,) = told(monkeypatch, chances, no_worse)
    assert one == settled()


def test_groups_that_forces_decided_stay(monkeypatch) -> None:
    assert told(monkeypatch, (0.9, 0.0), (True, False), by_lengths=False) == [settled(False)]


def test_a_place_that_is_in_the_model_no_more_is_not_asked(monkeypatch) -> None:
    (one,) = told(monkeypatch, (0.9, 0.0), (True, False), in_model=NAMES[1:])
    assert one == settled()


@pytest.mark.parametrize(("chance", "said"), [(0.04, 2), (0.06, 1)])
def test_geometry_that_is_nothing_as_it_is_told_is_not_named(monkeypatch, chance, said) -> None:
    """Axes of (-0.006 0.010 ..) +- 0.08 rad beside orientations that come 20 ms late."""
    monkeypatch.setattr(taken_back, "chance_of_nothing", lambda final, spread, name: chances[name])
    chances = {"clock_offset": 0.0, "pulley_axis": chance, "tether": 0.5}
    rounds = [won(name) for name in ("clock_offset", "pulley_axis")]
    final: Any = SimpleNamespace(model=SimpleNamespace(effects=tuple(chances)))
    told = module.shown(rounds, final, np.eye(1))
    every, stand = module.retold([*rounds, won("tether", False)], rounds, told)
    assert [one.decision.key for one in stand] == ["clock_offset", "pulley_axis"][:said]
    assert len(every) == 3
    (word,) = every[1].decision.candidates
    assert word.verdict == ("accepted" if said == 2 else "rejected")
    # Forces are asked where they are taken back, and nothing goes that stands alone.
    force = won("tether", False)
    assert module.shown([force, rounds[0]], final, np.eye(1))[0] is force
    chances["clock_offset"] = 0.5
    assert module.shown(rounds[:1], final, np.eye(1)) == rounds[:1]


def won(name: str, by_lengths: bool = True) -> Round:
    before: Any = "before"
    word = Candidate(name, "accepted", -9.0, 0.9, (), "lengths", 1.0)
    return Round(before, Decision((word,), before, name, (name,)), by_lengths=by_lengths)
