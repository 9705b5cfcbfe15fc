"""Joining, norms, reduction, sampling and delays of linear systems."""

import numpy as np
import pytest
import scipy.linalg

from freeswing.servo.synthesis.discretise import pade, zero_order_hold
from freeswing.servo.synthesis.norm import crossings, hinf_norm
from freeswing.servo.synthesis.reduction import truncate
from freeswing.servo.synthesis.state_space import StateSpace, append, close, gain, series

RATES = np.array([0.03, 0.7, 5.0, 90.0])


def stable(seed: int, n: int = 6, outputs: int = 2, inputs: int = 3) -> StateSpace:
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((n, n))
    A -= (np.linalg.eigvals(A).real.max() + 0.3) * np.eye(n)
    sizes = ((n, inputs), (outputs, n), (outputs, inputs))
    return StateSpace(A, *[rng.standard_normal(size) for size in sizes])


def test_series_and_append_multiply_and_stack_responses():
    first, second = stable(0), stable(1, outputs=4, inputs=2)
    np.testing.assert_allclose(
        series(first, second).at(RATES), second.at(RATES) @ first.at(RATES), rtol=1e-9
    )
    whole = append(first, second).at(RATES)
    np.testing.assert_allclose(whole[:, :2, :3], first.at(RATES), rtol=1e-9)
    np.testing.assert_allclose(whole[:, 2:, 3:], second.at(RATES), rtol=1e-9)
    assert not whole[:, :2, 3:].any()


def test_closing_a_loop_is_the_fractional_transformation():
    plant, controller = stable(2, outputs=4, inputs=5), stable(3, outputs=2, inputs=2)
    P, K = plant.at(RATES), controller.at(RATES)
    P11, P12, P21, P22 = P[:, :2, :3], P[:, :2, 3:], P[:, 2:, :3], P[:, 2:, 3:]
    wanted = P11 + P12 @ K @ np.linalg.inv(np.eye(2) - P22 @ K) @ P21
    np.testing.assert_allclose(close(plant, controller).at(RATES), wanted, rtol=1e-8)


def test_a_loop_whose_direct_terms_cancel_is_refused():
    with pytest.raises(ValueError, match="well posed"):
        close(gain(np.ones((2, 2))), gain(np.ones((1, 1))))


@pytest.mark.parametrize("seed", range(5))
def test_the_norm_is_reached_and_never_passed(seed):
    system = stable(seed)
    norm = hinf_norm(system)
    swept = np.linalg.norm(system.at(np.geomspace(1e-3, 1e4, 4000)), 2, axis=(1, 2)).max()
    assert swept <= norm.value * (1 + 1e-5)
    if np.isfinite(norm.rate_rad_s):
        there = np.linalg.norm(system.at(np.array([norm.rate_rad_s]))[0], 2)
        assert there == pytest.approx(norm.value, rel=1e-9)
    assert len(crossings(system, norm.value * 1.001)) == 0
    direct = np.linalg.norm(system.D, 2)
    if norm.value > direct * 1.01:
        assert len(crossings(system, norm.value * 0.999)) > 0


def test_the_norm_of_a_resonance_is_its_peak():
    z = 0.01
    system = StateSpace([[0, 1], [-1, -2 * z]], [[0], [1]], [[1, 0]], [[0]])
    peak = 1 / (2 * z * np.sqrt(1 - z * z))
    assert hinf_norm(system).value == pytest.approx(peak, rel=1e-6)


def test_an_unstable_system_has_no_norm():
    with pytest.raises(ValueError, match="real part"):
        hinf_norm(StateSpace([[0.1]], [[1.0]], [[1.0]], [[0.0]]))


@pytest.mark.parametrize("order", [0, 2, 4, 6])
def test_truncation_keeps_its_bound(order):
    system = stable(9)
    small = truncate(system, order)
    difference = append(system, small.system)
    both = StateSpace(
        difference.A,
        np.vstack([system.B, small.system.B]),
        np.hstack([system.C, -small.system.C]),
        system.D - small.system.D,
    )
    error = hinf_norm(both).value
    assert error <= small.bound * (1 + 1e-6) + 1e-9
    # Enns' lower bound: no system of this order comes nearer than the next singular value.
    assert order == system.order or error >= small.hankel[order] * (1 - 1e-6)


def test_an_unstable_system_is_not_truncated():
    with pytest.raises(ValueError, match="unstable"):
        truncate(StateSpace([[0.1]], [[1.0]], [[1.0]], [[0.0]]), 0)


def test_zero_order_hold_is_exact_for_held_inputs():
    system, period = stable(4), 0.02
    held = zero_order_hold(system, period)
    x, u = np.arange(6.0), np.array([1.0, -2.0, 0.5])
    settled = np.linalg.solve(system.A, system.B @ u)
    exact = scipy.linalg.expm(system.A * period) @ (x + settled) - settled
    np.testing.assert_allclose(held.A @ x + held.B @ u, exact, rtol=1e-10)
    assert held.period_s == period


def test_pade_has_gain_one_and_the_delays_phase():
    delay = 0.0137
    system = pade(delay, 2, 2)
    rates = np.linspace(0.0, 1.7 / delay, 50)
    response = system.at(rates)
    np.testing.assert_allclose(np.abs(response[:, 0, 0]), 1.0, rtol=1e-9)
    assert not np.abs(response[:, 0, 1]).any()
    error = np.angle(response[:, 1, 1] * np.exp(1j * rates * delay))
    assert np.rad2deg(np.abs(error).max()) < 1.0
    beyond = system.at(np.array([4.0 / delay]))[0, 0, 0] * np.exp(4.0j)
    assert np.rad2deg(abs(np.angle(beyond))) > 1.0


def test_a_discrete_pole_on_the_circle_is_not_stable():
    held = StateSpace([[1.0]], [[1.0]], [[1.0]], [[0.0]], 1e-3)
    assert not held.is_stable()
    assert StateSpace([[0.999]], [[1.0]], [[1.0]], [[0.0]], 1e-3).is_stable()


def test_matrices_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match="do not fit"):
        StateSpace(np.eye(2), np.ones((3, 1)), np.ones((1, 2)), [[0.0]])
