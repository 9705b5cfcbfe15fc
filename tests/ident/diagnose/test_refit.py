"""How a candidate is fitted: how far its search goes, and from where."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.effects.base import Parameter
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


@pytest.mark.parametrize(("value", "complaints"), [(-5e-5, 1), (5e-5, 0)])
def test_a_cable_does_not_weigh_less_than_nothing(value, complaints) -> None:
    """Beyond a range by chance it may lie; on the wrong side of nothing it is none."""
    parameter = Parameter("linear_density_over_mass_1_m", 0.0, 0.05, 0.002)
    model: Any = SimpleNamespace(robot=ROBOT, parameters=(parameter,))
    fit = SimpleNamespace(model=model, values=np.array([value]), std=lambda _: np.array([3e-5]))
    one: Any = SimpleNamespace(fit=fit, values_of=lambda _: slice(0, 1))
    found = module.plausible(one, "cable_mass")
    assert len(found) == complaints, found
    assert all("no such effect can have" in text for text in found), found


@pytest.mark.parametrize(("amplitude", "refused"), [(0.0, True), (1e-9, False)])
def test_a_candidate_that_no_step_takes_away_from_nothing_explains_nothing(
    monkeypatch, amplitude, refused
) -> None:
    """Its frequency is no amount."""
    parts = Parameter("sine_x_m_s2", -3.0, 3.0, 0.05, per_run=True)
    hz = Parameter("frequency_hz", 0.05, 40.0, 2.0, start=2.0, amplitude=False)
    model: Any = SimpleNamespace(
        place_of=lambda _: slice(1, 3), parameters=(None, parts, hz), robot=None
    )
    motions = [SimpleNamespace(values=np.array([0.3, one, 37.0])) for one in (0.0, amplitude)]
    monkeypatch.setattr(module, "inside", lambda *_: np.array([True, True]))
    found: Any = SimpleNamespace(model=model, motions=motions)
    assert module._does_nothing(found, "harmonic_force") == refused
