"""How long the search goes on adding effects."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.ident.diagnose import backward_removal
from freeswing.ident.diagnose import search as module
from freeswing.ident.diagnose.backward_removal import outdone, would_explain
from freeswing.ident.diagnose.decision import Candidate, Decision
from freeswing.ident.diagnose.search import Round, Search


@pytest.mark.parametrize(("there", "found"), [(5, 5), (8, 8), (20, 8)])
def test_effects_are_added_one_after_another(monkeypatch, there, found) -> None:
    """A day in the laboratory has five at once; nobody believes an answer of more than eight."""
    anything: Any = SimpleNamespace

    def one_more(self, current, index):
        if current.left == 0:
            return Round(current, Decision(()))
        after = anything(fit=None, left=current.left - 1)
        return Round(current, Decision((), after, f"effect-{index}", (f"effect-{index}",)))

    monkeypatch.setattr(Search, "_round", one_more)
    monkeypatch.setattr(Search, "_instead", lambda self, done, index: [done])
    monkeypatch.setattr(Search, "_geometry", lambda self, current: current)
    monkeypatch.setattr(module, "colour_of", lambda *_: 1.0)
    monkeypatch.setattr(module, "rescored", lambda base, *_: anything(fit=None, left=base.left))
    monkeypatch.setattr(Search, "_freed", lambda self, current: current)
    monkeypatch.setattr(module, "excess_of", lambda current: 100.0)
    monkeypatch.setattr(module, "too_small", lambda _: False)
    search = Search(np.ones(2), (), workers=1)
    last: Any = search.run(anything(left=there))
    assert sum(one.decision.winner is not None for one in search.rounds) == found
    assert last.left == there - found


@pytest.mark.parametrize(("excess", "is_freed"), [(0.47, True), (0.53, False)])
def test_errors_of_all_poses_are_not_asked_of_a_model_that_misses_more(
    monkeypatch, excess, is_freed
) -> None:
    """On a day that lacked five effects the frame of all runs was said to be off six deviations."""
    current: Any = SimpleNamespace()
    monkeypatch.setattr(module, "excess_of", lambda _: excess)
    monkeypatch.setattr(module, "freed", lambda *_: "freed")
    found = Search(np.ones(2), (), workers=1)._freed(current)
    assert (found == "freed") == is_freed


def word(effect: str, probability: float, verdict: str = "rejected") -> Candidate:
    return Candidate(effect, verdict, -100.0, 0.9, (), "", probability)


@pytest.mark.parametrize(("fan", "stands_in"), [(0.045, True), (0.055, False)])
def test_what_impossible_values_explain_far_better_is_none_of_the_catalogue(
    monkeypatch, fan, stands_in
) -> None:
    """A draught that feeds the swing: a drag of less than nothing, and the nearest that can be."""
    said = {"quadratic_drag": ["coefficient_1_m = -0.16: below 0"]}
    monkeypatch.setattr(backward_removal, "plausible", lambda _, key: said.get(key, []))
    words = (word("harmonic_force", fan, "accepted"), word("quadratic_drag", 1.0 - fan))
    won: Any = Decision(words, None, "harmonic_force", ("harmonic_force",))
    tried: Any = dict.fromkeys(["harmonic_force", "quadratic_drag"])
    found = outdone(won, tried)
    assert bool(found) == stands_in
    assert not found or "quadratic_drag with values that cannot be" in found
    assert not outdone(won, {"harmonic_force": tried["harmonic_force"]})


@pytest.mark.parametrize(("drag", "is_said"), [(0.97, True), (0.93, False)])
def test_where_nothing_won_what_impossible_values_surely_explain_is_said(
    monkeypatch, drag, is_said
) -> None:
    """The swings gain energy: a drag of less than nothing, and nobody was told."""
    said = ["rate_1_s = -0.02: below 0"]
    monkeypatch.setattr(backward_removal, "impossible_values", lambda *_: said)
    nobody: Any = Decision((word("translational_drag", drag),))
    found = would_explain(nobody, {"translational_drag": nobody})
    assert bool(found) == is_said
    assert not found or found.startswith("translational_drag would explain it with values")


@pytest.mark.parametrize(("which", "left"), [(1, 0), (0, 2)])
def test_a_stand_in_that_came_last_is_taken_back_and_one_that_made_way_is_not(which, left) -> None:
    fits: Any = [SimpleNamespace(place=k) for k in range(3)]
    rounds = [
        Round(
            fits[k],
            Decision((word(f"e{k}", 0.9, "accepted"),), fits[k + 1], f"e{k}", (f"e{k}",)),
            stand_in="the nearest" if k == which else "",
        )
        for k in range(2)
    ]
    search = Search(np.ones(2), (), workers=1, rounds=[*rounds, Round(fits[2], Decision(()))])
    last: Any = search._without_stand_ins(fits[2])
    assert last.place == (1 if which == 1 else 2)
    assert [one.decision.winner is not None for one in search.rounds][:2] == [True, which == 0]
    told = search.rounds[-1].decision.candidates
    assert [(one.verdict, one.reason) for one in told] == (
        [("rejected", "the nearest")] if left == 0 else []
    )


@pytest.mark.parametrize(
    ("first", "other", "ends"), [(0.47, 0.0, "a"), (0.53, 0.47, "b"), (0.53, 0.53, "a")]
)
def test_the_way_that_left_out_runs_speak_for_stands_where_only_it_ends_near_the_noise(
    monkeypatch, first, other, ends
) -> None:
    """Beside viscous swivels a constant force led (0.26), and ended at nine times the noise."""
    fits: Any = {name: SimpleNamespace(fit=None, name=name, slowly="") for name in "ab"}
    fits["base"] = SimpleNamespace(fit=None, name="base")
    excess = {"base": 50.0, "a": first, "b": other}
    led: Any = Decision((), fits["a"], "a", ("a", "b"), fits["b"], ("b", fits["b"]))

    def rounds(self, current, index):
        return Round(current, led) if current is fits["base"] else Round(current, Decision(()))

    monkeypatch.setattr(Search, "_round", rounds)
    monkeypatch.setattr(Search, "_instead", lambda self, done, index: [done])
    monkeypatch.setattr(Search, "_geometry", lambda self, current: current)
    monkeypatch.setattr(Search, "_freed", lambda self, current: current)
    monkeypatch.setattr(module, "colour_of", lambda *_: 1.0)
    monkeypatch.setattr(module, "rescored", lambda *_: fits["base"])
    monkeypatch.setattr(module, "polished", lambda *_: fits["b"])
    monkeypatch.setattr(module, "superfluous", lambda *_: "")
    monkeypatch.setattr(module, "excess_of", lambda current: excess[current.name])
    monkeypatch.setattr(module, "too_small", lambda _: False)
    monkeypatch.setattr(backward_removal, "effect_of", lambda key: key)
    search = Search(np.ones(2), (), workers=1)
    last: Any = search.run(fits["base"])
    won = [one.decision for one in search.rounds if one.decision.winner is not None]
    assert (last.name, [one.key for one in won]) == (ends, [ends])
    assert set(won[0].group) == {"a", "b"}
    assert won[0].rival is fits["a" if ends == "b" else "b"]
