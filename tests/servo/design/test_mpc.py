"""The predictive controller: its plan, its bounds, its observer."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from freeswing.servo.design.mpc import PLAN_STEPS, design_mpc
from freeswing.servo.design.plant import Plant
from freeswing.servo.loop.predictive import (
    Bounds,
    PredictiveRegulator,
    _free_plan,
    _Program,
    solve_box,
)
from freeswing.servo.synthesis.discretise import zero_order_hold
from tests.servo.plants import DRUM_M, TORQUE_N_M_A, cables, inca_plant

MASS = np.linalg.inv(inca_plant().B[6:])
# W_I grows with the winding: a cable pulls towards its entry.
MATRIX = -cables(np.zeros(6))[1].T * TORQUE_N_M_A / DRUM_M
SPEEDS = np.repeat([6.0, 7.0], 3)


def predictor(delay_s=0.0):
    return design_mpc(Plant(np.zeros(6), np.zeros(6), MASS, inca_plant(), delay_s), SPEEDS)


def bounds(low=0.0, high=3.0):
    return Bounds(
        np.zeros(6), MATRIX @ np.full(8, 1.5), MATRIX, np.full(8, low), np.full(8, high),
        np.full(8, 1.5),
    )  # fmt: skip


def test_boxes_are_solved_as_by_bounded_least_squares():
    rng = np.random.default_rng(0)
    for _ in range(5):
        root = rng.standard_normal((20, 12))
        f = 50.0 * rng.standard_normal(12)
        H = root.T @ root
        L = np.linalg.cholesky(H)
        outside = lsq_linear(L.T, -np.linalg.solve(L, f), (-1.0, 1.0), tol=1e-14).x
        assert (np.abs(outside) > 1 - 1e-9).any()
        np.testing.assert_allclose(solve_box(H, f, -np.ones(12), np.ones(12)), outside, atol=1e-8)


def test_the_plan_without_bounds_is_the_regulators():
    """The last state's cost makes ten steps as good as all."""
    p = predictor()
    program = _Program(p, bounds(-1e3, 1e3))
    rng = np.random.default_rng(1)
    away = rng.standard_normal(12) * np.repeat([0.1, 0.5], 6)
    free = (_free_plan(p) @ away).reshape(PLAN_STEPS, 6)
    np.testing.assert_allclose(free[0], -p.gain @ away)
    found = program.best(away, np.zeros(6))
    np.testing.assert_allclose(found, free[0], atol=1e-3 * np.abs(free[0]).max())


def test_a_step_too_large_for_the_motors_is_planned_within_their_currents():
    p, b = predictor(), bounds()
    regulator = PredictiveRegulator(p, b)
    far = np.array([0.8, 0.0, 0.0, 0.0, 0.0, 0.0])
    wrench = regulator.wrench(far, far, True)
    assert regulator.solved == 1
    free = p.by_pose @ far
    wanted = free[12:] + p.gain @ free[:12]
    assert np.abs(wanted[0]) > 2 * np.abs(wrench[0]), "the bounds should matter here"
    # Some currents in the box make it: bounded least squares leaves nothing.
    left = lsq_linear(MATRIX, b.rest + wrench, (b.lower, b.upper), tol=1e-14)
    assert left.cost < 1e-12, left.cost
    near = PredictiveRegulator(p, b)
    near.wrench(0.01 * far, 0.01 * far, True)
    assert near.solved == 0


def test_a_wrench_from_outside_is_outweighed():
    """A constant one on the sampled plant: nothing of it is left, and the estimate is it."""
    regulator = PredictiveRegulator(predictor(), bounds(-1e3, 1e3))
    plant = zero_order_hold(inca_plant(), 1e-3)
    x, goal = np.zeros(12), np.array([0.05, 0.0, 0.02, 0.0, 0.0, 0.01])
    outside = np.array([0.3, -0.2, 0.1, 0.0, 0.01, 0.0])
    for _ in range(4000):
        wrench = regulator.wrench(goal - x[:6], goal, True)
        regulator.applied(wrench)
        x = plant.A @ x + plant.B @ (wrench + outside)
    np.testing.assert_allclose(x[:6], goal, atol=2e-5)
    np.testing.assert_allclose(regulator._state[-6:], outside, atol=2e-3)


@pytest.mark.parametrize("delay_s", [0.0, 0.0132])
def test_the_law_without_bounds_is_what_the_regulator_does(delay_s):
    p = predictor(delay_s)
    regulator = PredictiveRegulator(p, bounds(-1e4, 1e4))
    k = zero_order_hold(p.unbounded(), 1e-3)
    x, rng = np.zeros(k.order), np.random.default_rng(2)
    wanted, given = [], []
    level = rng.standard_normal(6)
    for step in range(300):
        error = 0.01 * level * np.sin(0.02 * step)
        wanted.append(k.C @ x + k.D @ error)
        x = k.A @ x + k.B @ error
        given.append(regulator.wrench(error, np.zeros(6), True))
        regulator.applied(given[-1])
    # One holds its wrench for a sample where the other does not: a millisecond apart.
    gap = np.abs(np.array(wanted) - given).max() / np.abs(wanted).max()
    assert gap < 0.03, gap
