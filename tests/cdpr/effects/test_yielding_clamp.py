"""A hook that gives way sideways, against a swing of the independent simulator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from freeswing.cdpr.effects import catalogue
from freeswing.cdpr.effects.base import Recorded
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import Array, Cable, Robot
from freeswing.cdpr.simulation.free_swing import simulate
from freeswing.ident.bench.chart import Chart
from freeswing.ident.bench.objects import entries, spread
from tests.cdpr.model_cases import robot_named
from tests.oracle.mechanics.newton_euler import Motion
from tests.oracle.recorded import benches
from tests.oracle.recorded.sessions import tait_bryan

HOOK_N_M = 500.0
SPAN_S = 3.0


def robot() -> Robot:
    above = np.array([0.0, 0.0, benches.WIRE_M])
    ends = benches._ends(3)
    cables = tuple(Cable(str(k), end + above, 0.0, end) for k, end in enumerate(ends))
    return Robot("bench", cables, np.array([0.0, 0.0, -benches.GRAVITY]))


@pytest.fixture(scope="module")
def motion() -> Motion:
    """A swing of the empty platform, the first hook of which yields."""
    hidden = benches.Hidden(0.0, 1.0, 0.0, 0.0, yields_n_m=HOOK_N_M, yielding=1)
    world = benches._world(3, "tare", benches.WEIGHT_M, hidden)
    return benches._swing(world, np.random.default_rng(0), SPAN_S, benches.RATE_HZ)


def off(motion: Motion, effects: tuple[str, ...], values: Array) -> Array:
    """Root mean square of x, y, yaw that a swing from the likeliest start leaves, m and rad."""
    com = benches.PLATFORM_COM_M
    about_p = entries(np.diag(benches.PLATFORM_KG_M2) / benches.DECLARED_KG + spread(com))
    inertia = np.concatenate([com, about_p])
    model, times = build_model(robot(), effects), motion.times_s
    seen = np.hstack([motion.positions_m, tait_bryan(motion.quaternions)])
    rates = CubicSpline(times, seen)(times[0], 1)
    chart, lengths = Chart.about(model, seen[0]), np.full(3, benches.WIRE_M)

    def left(numbers: Array) -> Array:
        state = chart.state(numbers, lengths, 0.0, inertia, values)
        span = (float(times[0]), float(times[-1]))
        told = simulate(model, state[:6], state[6:], span, inertia, values, 1e-7).at(times)[0]
        return ((told - seen) * [1.0, 1.0, 0.0, 0.0, 0.0, 0.2]).ravel()

    found = least_squares(left, chart.numbers(seen[0], rates), x_scale=0.01, max_nfev=8)
    rows = found.fun.reshape(-1, 6)[:, [0, 1, 5]] / [1.0, 1.0, 0.2]
    return np.sqrt(np.mean(rows**2, axis=0))


def test_a_hook_yields_as_the_independent_simulator_says(motion: Motion) -> None:
    without = off(motion, (), np.zeros(0))
    found = off(motion, ("yielding_clamp",), np.array([benches.DECLARED_KG / HOOK_N_M, 0.0, 0.0]))
    told = f"left {found}, without it {without}"
    assert (without > [5e-6, 2e-5, 3e-5]).all(), told
    # Left is what stretches in the simulator (EA 100 kN), and the yielding to second order.
    assert (found < 0.06 * without).all(), told


def test_cables_over_pulleys_have_no_hooks() -> None:
    effect = catalogue()["yielding_clamp"]
    assert not effect.cannot_show(robot(), Recorded())
    assert "not from hooks" in effect.cannot_show(robot_named("bologna-4"), Recorded())
