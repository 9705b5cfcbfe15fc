"""The first seconds of a run as small oscillations: which waves are followed, which are held."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.statics import modes
from freeswing.ident.bench import fit_rounds
from freeswing.ident.bench.assemble import EFFECTS
from freeswing.ident.bench.first_guesses import glimpse, sight
from freeswing.ident.bench.swing import Column
from tests.ident.bench.test_rolled import WIRE_M, hanging
from tests.ident.bench.test_swing_slopes import trifilar

INERTIA = np.array([0.0, 0.0, -0.05, 0.02, 0.02, 0.035, 0.0, 0.0, 0.0])
TIMES_S = np.arange(300) / 50.0
LENGTHS_M = np.full(3, 1.2)


def yaw_and(sway_m: float | None):
    """A first look at a twist of 0.1 rad, x beside it or not measured."""
    model = build_model(trifilar(), EFFECTS)
    still = Column("chi", np.zeros(300), np.full(300, 1e-3), 5)
    rest = sight(model, "a", LENGTHS_M, INERTIA, TIMES_S, (still,), {}).rest
    hertz = modes(model, rest, INERTIA).frequencies_hz.max()
    chi = 0.1 * np.cos(2.0 * np.pi * hertz * TIMES_S)
    columns = [Column("chi", chi, np.full(300, 1e-3), 5)]
    if sway_m is not None:
        noise = np.random.default_rng(0).normal(0.0, sway_m, 300)
        columns.insert(0, Column("x", noise, np.full(300, 1e-4), 0))
    view = sight(model, "a", LENGTHS_M, INERTIA, TIMES_S, columns, {})
    return glimpse(model, view, INERTIA)


@pytest.mark.parametrize("sway_m", [1e-2, 1e-4, 1e-6])
def test_yaw_is_followed_however_little_the_platform_sways(sway_m: float) -> None:
    found = yaw_and(sway_m)
    assert found.residuals[1] < 0.01, found.residuals  # a tenth of its amplitude
    assert abs(found.zeta[5]) == pytest.approx(0.1, abs=0.01)


def test_a_wave_that_no_column_sees_stays_small() -> None:
    found = yaw_and(None)
    assert np.abs(found.moved[:, :2]).max() < 0.02, np.abs(found.moved).max(axis=0)


def test_yaw_is_followed_where_the_guess_leans_and_the_platform_does_not() -> None:
    """Guessed to roll by 40 mrad, yaw brings 4 mrad of pitch along; measured are 0.5 of noise."""
    model, lengths = hanging().model, np.full(2, WIRE_M)
    inertia = INERTIA + np.eye(9)[1] * 0.002
    rng = np.random.default_rng(0)

    def seen(hertz: float):
        chi = 0.1 * np.cos(2.0 * np.pi * hertz * TIMES_S)
        values = rng.normal(0.0, 3e-3, 300), rng.normal(0.0, 5e-4, 300), chi
        columns = [Column("", one, np.full(300, 5e-4), 3 + k) for k, one in enumerate(values)]
        return sight(model, "a", lengths, inertia, TIMES_S, columns, {})

    found = modes(model, seen(1.0).rest, inertia)
    yaw = int(np.argmax(np.abs(found.shapes[5]) / np.abs(found.shapes[:5]).max(axis=0)))
    told = glimpse(model, seen(found.frequencies_hz[yaw]), inertia)
    assert abs(told.zeta[5]) == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize(
    ("lasts_s", "followed_s"), [(11.0, []), (13.0, [12.0]), (35.0, [12.0]), (70.0, [12.0, 36.0])]
)
def test_long_runs_are_followed_in_growing_stretches(monkeypatch, lasts_s, followed_s) -> None:
    """The first is twice what a guess saw, each next three times the last."""
    asked = []

    class Swing(SimpleNamespace):
        def until(self, end_s):
            return end_s - self.span_s[0]

    def fit(parts, unknowns, how):
        asked.append(parts)
        return SimpleNamespace(unknowns=[*unknowns, len(asked)])

    monkeypatch.setattr(fit_rounds, "fit", fit)
    swings: Any = (Swing(span_s=(2.0, 2.0 + lasts_s)), Swing(span_s=(5.0, 9.0)))
    none: Any = []
    assert fit_rounds.stretched(swings, none, fit_rounds.FIRST_S) == list(
        range(1, 1 + len(followed_s))
    )
    np.testing.assert_allclose([parts[0] for parts in asked], followed_s, rtol=0.05)
    np.testing.assert_allclose([parts[1] for parts in asked], followed_s, rtol=0.05)


@pytest.mark.parametrize(
    ("lost", "again", "kept", "followed_s"),
    [(False, 1.0, 9.0, []), (True, 1.0, 1.0, [3.3, 9.9]), (True, 10.0, 9.0, [3.3, 9.9])],
)
def test_a_lost_fit_is_made_again_from_a_few_swings(
    monkeypatch, lost, again, kept, followed_s
) -> None:
    """Wires of 1.2 m swing in 2.2 s; one and a half swings first, and the cheaper fit stands."""
    asked, costs = [], iter([9.0, again])

    class Swing(SimpleNamespace):
        def until(self, end_s):
            return end_s

    def fit(parts, unknowns, how):
        whole = not isinstance(parts[0], float)
        if not whole:
            asked.append(parts[0])
        return SimpleNamespace(unknowns=unknowns, cost=next(costs) if whole else 0.0)

    monkeypatch.setattr(fit_rounds, "fit", fit)
    monkeypatch.setattr(fit_rounds, "left_worst", lambda *_: "phi" if lost else None)
    robot = SimpleNamespace(gravity_m_s2=np.array([0.0, 0.0, -9.81]))
    swing = Swing(span_s=(0.0, 11.0), lengths_m=LENGTHS_M, model=SimpleNamespace(robot=robot))
    swings: Any = (swing,)
    none: Any = []
    assert fit_rounds.first_fit(swings, none).cost == kept
    np.testing.assert_allclose(asked, followed_s, rtol=0.02)
