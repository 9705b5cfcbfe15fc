"""Motions near a linearised one are those that a simulation gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.free_motion import admissible_rates
from freeswing.cdpr.simulation import simplified_newton
from freeswing.cdpr.simulation.free_swing import simulate, tails
from freeswing.cdpr.simulation.sensitivity import linearise
from freeswing.cdpr.simulation.simplified_newton import Surroundings, obeys
from tests.cdpr.model_cases import swing_start

TOLERANCE_M = 1e-9
SPAN_S = (0.0, 4.0)


@pytest.mark.parametrize("size", [0.01, 0.3])
def test_it_is_what_a_simulation_gives(size: float) -> None:
    values = np.array([0.1, 0.3])
    model, inertia, zeta, rates = swing_start("bologna-4", ("translational_drag",), values=values)
    known = simulate(model, zeta, rates, SPAN_S, inertia, values, TOLERANCE_M)
    moved, other = zeta + size * np.array([1, -1, 0.5, 1, -1, 1]) * 1e-2, values * (1.0 + size)
    heavier = inertia * (1.0 + 0.1 * size)
    speeds = admissible_rates(model, moved, rates, heavier, other)
    found = Surroundings.of(linearise(known)).motion_at(moved, speeds, heavier, other, TOLERANCE_M)
    expected = simulate(model, moved, speeds, SPAN_S, heavier, other, TOLERANCE_M)
    assert found is not None
    times = np.linspace(*SPAN_S, 200)
    far = np.abs(expected.at(times)[0] - known.at(times)[0]).max()
    gap = np.abs(found.at(times)[0] - expected.at(times)[0]).max()
    assert gap < 100 * TOLERANCE_M < 1e-3 * far, f"{gap:.1e} m apart, {far:.1e} m from the known"
    assert tails(found).max() <= 4 * TOLERANCE_M


def test_slopes_by_what_is_held_are_not_missed() -> None:
    model, inertia, zeta, rates = swing_start("bologna-4", ("translational_drag",))
    values = np.array([0.1, 0.3])
    known = simulate(model, zeta, rates, SPAN_S, inertia, values, TOLERANCE_M)
    held = linearise(known, wanted=np.zeros(11, dtype=bool))
    speeds = admissible_rates(model, zeta + 1e-4, rates, inertia, values)
    arguments = (zeta + 1e-4, speeds, inertia, values, TOLERANCE_M)
    found = Surroundings.of(held).motion_at(*arguments)
    whole = Surroundings.of(linearise(known)).motion_at(*arguments)
    assert found is not None
    assert whole is not None
    np.testing.assert_allclose(found.zetas, whole.zetas, atol=TOLERANCE_M)


def test_what_is_not_near_is_left_to_a_simulation(monkeypatch: pytest.MonkeyPatch) -> None:
    model, inertia, zeta, rates = swing_start("bologna-4", ())
    values = model.start_values
    known = simulate(model, zeta, rates, SPAN_S, inertia, values, TOLERANCE_M)
    around = Surroundings.of(linearise(known))
    arguments = (inertia, values, TOLERANCE_M)
    far = zeta + np.array([0.2, 0.2, 0.1, 0.3, 0.3, 0.3])
    speeds = admissible_rates(model, far, rates, inertia, values)
    assert around.motion_at(far, speeds, *arguments) is None
    # Segments that were long enough for a loose tolerance are too long for a tight one.
    assert around.motion_at(zeta, rates, inertia, values, 1e-13) is None
    monkeypatch.setattr(simplified_newton, "SWEEPS", 0)
    assert around.motion_at(zeta, rates, *arguments) is None


def test_a_start_that_the_cables_do_not_allow_is_refused() -> None:
    model, inertia, zeta, rates = swing_start("bologna-4", ())
    values = model.start_values
    around = Surroundings.of(
        linearise(simulate(model, zeta, rates, (0.0, 0.5), inertia, values, TOLERANCE_M))
    )
    with pytest.raises(ValueError, match="lengthen cable"):
        around.motion_at(zeta, rates + 0.1, inertia, values, TOLERANCE_M)


def test_a_motion_obeys_a_model_that_adds_nothing_and_no_other() -> None:
    model, inertia, zeta, rates = swing_start("bologna-4", ())
    known = simulate(model, zeta, rates, SPAN_S, inertia, None, TOLERANCE_M)
    wider = build_model(model.robot, ("translational_drag",))
    assert obeys(replace(known, model=wider, values=np.zeros(2)), TOLERANCE_M)
    assert not obeys(replace(known, model=wider, values=np.array([1e-3, 0.0])), TOLERANCE_M)
