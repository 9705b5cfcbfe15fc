"""How a candidate is fitted: how far its search goes, and from where."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.effects import effect_named
from freeswing.ident.diagnose import refit as module
from tests.oracle.scenes.robots import declared_robot

ROBOT = declared_robot("three-cable")


def test_a_search_ends_by_what_the_fit_costs_as_it_is_weighed(monkeypatch) -> None:
    """Beside a colour of 6500 every step looked small, and candidates stayed where they began."""
    known: dict[str, float] = {}
    swings: Any = SimpleNamespace(under=lambda *_: "swings", scales=None)
    monkeypatch.setattr(module, "_joined", lambda *_: (None, None))
    monkeypatch.setattr(module, "replace", lambda one, **_: one)
    monkeypatch.setattr(module, "ranked", lambda _, __, cost: known.update(cost=cost))
    current: Any = SimpleNamespace(
        samples=[None] * 3, model=None, unknowns=None, swings=swings, cost=9e4, scales=np.ones(2)
    )
    module._refitted(current, "tether", np.zeros(8), np.full(2, 30.0))
    assert known["cost"] == pytest.approx(100.0)


@pytest.mark.parametrize("converged", [True, False])
def test_another_shape_is_tried_where_the_first_did_not_converge(monkeypatch, converged) -> None:
    """At no pull the direction of a tether is not defined: from a half it went nowhere."""
    names = [one.name for one in effect_named("tether").parameters(ROBOT)]
    began: list[float] = []

    def fitted(_, __, values, ___):
        began.append(values[names.index("rest_share")])
        return SimpleNamespace(converged=converged, cost=began[-1])

    monkeypatch.setattr(module, "_refitted", fitted)
    monkeypatch.setattr(module, "_does_nothing", lambda *_: False)
    monkeypatch.setattr(module, "rescored", lambda found, *_: found)
    current: Any = SimpleNamespace(model=SimpleNamespace(robot=ROBOT))
    start = np.array([one.start for one in effect_named("tether").parameters(ROBOT)])
    found: Any = module.refit(current, "tether", start, np.ones(2), 1.0)
    assert began == ([0.5] if converged else [0.5, 0.3])
    assert found.cost == min(began)


@pytest.mark.parametrize("lost", [0.5, 0.3])
def test_a_start_that_cannot_be_followed_takes_no_other_away(monkeypatch, lost) -> None:
    parameters = effect_named("tether").parameters(ROBOT)
    share = [one.name for one in parameters].index("rest_share")

    def fitted(_, __, values, ___):
        if values[share] == lost:
            raise ValueError("no pose")
        return SimpleNamespace(converged=False, cost=values[share])

    monkeypatch.setattr(module, "_refitted", fitted)
    monkeypatch.setattr(module, "_does_nothing", lambda *_: False)
    monkeypatch.setattr(module, "rescored", lambda found, *_: found)
    current: Any = SimpleNamespace(model=SimpleNamespace(robot=ROBOT))
    start = np.array([one.start for one in parameters])
    found: Any = module.refit(current, "tether", start, np.ones(2), 1.0)
    assert found.cost == (0.3 if lost == 0.5 else 0.5)


@pytest.mark.parametrize(("metres", "refused"), [(2e-5, True), (2e-3, False)])
def test_a_displacement_of_nothing_is_refused_but_not_impossible(metres, refused) -> None:
    names = effect_named("anchor_offset").parameters(ROBOT)
    fit = SimpleNamespace(
        model=SimpleNamespace(robot=ROBOT, parameters=names),
        values=np.full(len(names), metres),
        std=lambda _: np.full(len(names), 1e-6),
    )
    one: Any = SimpleNamespace(fit=fit, values_of=lambda _: slice(0, len(names)))
    assert bool(module.plausible(one, "anchor_offset")) == refused
    assert module.impossible_values(one, "anchor_offset") == []
