"""The one rule of all controllers, and what weights do when their rates move."""

import numpy as np
import pytest

from freeswing.servo.design import family
from freeswing.servo.design.controller import HALF_HOLD_S
from freeswing.servo.design.hinf import design_hinf
from freeswing.servo.design.lqg import design_lqg
from freeswing.servo.design.mpc import PLAN_STEP_S, design_mpc
from freeswing.servo.design.plant import Plant
from freeswing.servo.design.tuning import LEAST_MARGIN, MOST_NOISE, RATES_RAD_S, Noise, look
from freeswing.servo.files.weights_file import USUAL
from freeswing.servo.synthesis.state_space import StateSpace
from freeswing.servo.synthesis.weights import Filter
from tests.servo.plants import inca_plant

NOISE = Noise(np.repeat([0.0017, 0.005], 3), 0.005)


def plant(delay_s):
    mass = np.linalg.inv(inca_plant().B[6:])
    return Plant(np.zeros(6), np.zeros(6), mass, inca_plant(), delay_s)


@pytest.mark.parametrize("slope", [-2, 0, 2])
@pytest.mark.parametrize(
    "filter_", [Filter(40.0, 0.01, 1e4, 2), Filter(10.0, 10.0, 1e-4, 1), Filter(3.0)]
)
def test_faster_filters_are_the_same_at_moved_rates(filter_, slope):
    rates = np.geomspace(1e-3, 1e4, 20)
    np.testing.assert_allclose(
        filter_.faster(1.7, slope).at(1.7 * rates), 1.7**slope * filter_.at(rates), rtol=1e-12
    )


def keeps(given, controller):
    response = given.system.at(RATES_RAD_S)
    seen = look(given, response, controller, given.delay_s + HALF_HOLD_S, NOISE)
    small = (np.array(seen.noise) <= MOST_NOISE).all()
    return seen.stable and min(seen.margins) >= LEAST_MARGIN and small


def test_the_fastest_weights_keep_the_rule_and_the_next_ones_do_not(monkeypatch):
    given = plant(0.0)
    monkeypatch.setattr(family, "SHARES", np.array([1.0, 1.2, 1.5]))
    found = family.design("hinf-fastest", given, USUAL, NOISE, np.eye(6), with_delay=False)
    assert found.facts["share"] == 1.2
    assert keeps(given, found.system)
    assert not keeps(given, design_hinf(given, USUAL.faster(1.5)).system)


@pytest.mark.parametrize("method", ["lqg", "mpc", "pid"])
def test_each_controller_keeps_the_rule_at_its_delay(method):
    given = plant(0.0132)
    found = family.design(method, given, USUAL, NOISE, np.eye(6), with_delay=True)
    assert keeps(given, found.system)
    assert found.delayed.stable
    assert (found.predictor is not None) == (method == "mpc")


def test_a_method_that_there_is_not_is_refused():
    with pytest.raises(ValueError, match="one of hinf, hinf-fastest"):
        family.design("fuzzy", plant(0.0), USUAL, NOISE, np.eye(6), with_delay=False)


def floating():
    """1/s^2 in six axes, each of mass one."""
    zero, one = np.zeros((6, 6)), np.eye(6)
    A = np.block([[zero, one], [zero, zero]])
    return StateSpace(A, np.vstack([zero, one]), np.hstack([one, zero]), zero)


def test_speeds_are_poles_of_a_floating_mass():
    speeds = np.array([2.0, 3.0, 4.0, 5.0, 6.0, 7.0])
    lqg = design_lqg(floating(), np.eye(6), speeds)
    A = np.block([[floating().A, np.zeros((12, 6))], [floating().C, np.zeros((6, 6))]])
    B = np.vstack([floating().B, np.zeros((6, 6))])
    poles = np.sort_complex(np.linalg.eigvals(A - B @ lqg.gain))
    np.testing.assert_allclose(poles, -np.sort(np.repeat(speeds, 3))[::-1], rtol=2e-2)
    p = design_mpc(Plant(np.zeros(6), np.zeros(6), np.eye(6), floating(), 0.0), speeds)
    rates = np.log(np.linalg.eigvals(p.step_A - p.step_B @ p.gain)) / PLAN_STEP_S
    # A cost summed over steps of 20 ms is the integral's to some per cent.
    np.testing.assert_allclose(np.sort(rates.real), -np.sort(np.repeat(speeds, 2))[::-1], rtol=0.1)
