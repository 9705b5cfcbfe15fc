"""How long the search goes on adding effects."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.ident.diagnose import search as module
from freeswing.ident.diagnose.decision import Decision
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
