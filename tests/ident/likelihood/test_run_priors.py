"""What is known of a run's own values weighs as much as it is told to."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.cdpr.simulation.free_swing import simulate
from freeswing.cdpr.simulation.sensitivity import linearise
from freeswing.ident.likelihood.run_residuals import Reduced, Samples, predicted, reduce_run
from tests.cdpr.model_cases import swing_start


def gram(found: Reduced) -> Array:
    """Of all equations, over [own; shared; residual]."""
    own = found.own.shape[0]
    whole = found.own.T @ found.own
    whole[own:, own:] += found.rows.T @ found.rows
    return whole


def test_a_frame_s_prior_is_raised_and_nothing_else() -> None:
    model, inertia, zeta, rates = swing_start("bologna-4", ("platform_frame",))
    motion = simulate(model, zeta, rates, (0.0, 0.5), inertia, None, 1e-8)
    times = np.linspace(0.0, 0.5, 30)
    samples = Samples(
        "one", times, POSE_COORDINATES, predicted(motion, times) + 1e-3,
        np.tile(np.eye(6), (30, 1, 1)), np.repeat([0, 1], 3), None, 1.0, (0.0, 0.5),
    )  # fmt: skip
    linear, ones = linearise(motion), np.ones(2)
    once = gram(reduce_run(linear, samples, ones))
    more = gram(reduce_run(linear, samples, ones, prior_weight=3.0))
    expected = np.zeros_like(once)
    places = np.arange(8, 14)  # after the eight numbers of a start on four cables
    expected[places, places] = 8.0 / np.array([p.prior_std for p in model.parameters]) ** 2
    assert more - once == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_unknowns_that_are_held_leave_the_equations_of_the_others() -> None:
    effects = ("platform_frame", "attachment_offset", "translational_drag")
    model, inertia, zeta, rates = swing_start("bologna-4", effects)
    motion = simulate(model, zeta, rates, (0.0, 0.5), inertia, None, 1e-8)
    times = np.linspace(0.0, 0.5, 30)
    samples = Samples(
        "one", times, POSE_COORDINATES, predicted(motion, times) + 1e-3,
        np.tile(np.eye(6), (30, 1, 1)), np.repeat([0, 1], 3), np.full(4, 2.0), 1e-3, (0.0, 0.5),
    )  # fmt: skip
    wanted = np.zeros(9 + len(model.parameters), dtype=bool)
    wanted[[0, 3, 16]] = True
    wanted[9 + model.own_values] = True
    whole = reduce_run(linearise(motion), samples, np.ones(2))
    some = reduce_run(linearise(motion, wanted=wanted), samples, np.ones(2))
    kept = np.append(wanted, True)
    for one, other in ((whole.rows, some.rows), (whole.own[:, 14:], some.own[:, 14:])):
        expected = one[:, kept].T @ one[:, kept]
        assert other[:, kept].T @ other[:, kept] == pytest.approx(
            expected, rel=1e-9, abs=1e-12 * np.abs(expected).max()
        )
        assert not other[:, ~kept].any()
