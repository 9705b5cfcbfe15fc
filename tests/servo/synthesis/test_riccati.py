"""The synthesis against the paper's numbers, an outside solver and its own promise."""

import numpy as np
import pytest

from freeswing.servo.files.weights_file import USUAL
from freeswing.servo.synthesis.four_block import weighted
from freeswing.servo.synthesis.gamma_search import BACK_OFF, synthesise
from freeswing.servo.synthesis.riccati import (
    StandardProblem,
    central_controller,
    normalise,
    solve_at,
)
from freeswing.servo.synthesis.state_space import StateSpace, close
from freeswing.servo.synthesis.weights import Filter, Part, Weights
from tests.servo.plants import inca_plant, random_problem


def printed() -> Weights:
    """Eq. (24) as it stands in print."""
    part = [
        Part(Filter(0.5), Filter(gain, 1e-2, 1e4, 2), Filter(w3, 10.0, 1e4, 1))
        for gain, w3 in ((250.0, 10.0), (100.0, 1.0))
    ]
    return Weights(*part)


def test_the_printed_weights_give_gamma_one_half():
    found = synthesise(weighted(inca_plant(), printed()))
    assert abs(found.gamma_least - 0.5) < 1e-3, found.gamma_least
    assert found.controller.order == 30


def test_the_corrected_weights_give_gamma_094():
    found = synthesise(weighted(inca_plant(), USUAL))
    assert 0.935 < found.gamma_least <= 0.945, found.gamma_least
    assert found.norm <= found.gamma * 1.001
    assert found.controller.poles().real.min() > -1e3, "too fast to be run at 1 kHz"


@pytest.mark.parametrize("seed", range(8))
def test_the_closed_loop_has_the_norm_that_was_promised(seed):
    problem = random_problem(seed)
    found = synthesise(problem)
    loop = close(problem.plant, found.controller)
    assert loop.is_stable()
    rates = np.geomspace(1e-4, 1e5, 2000)
    swept = np.linalg.norm(loop.at(np.r_[0.0, rates]), 2, axis=(1, 2)).max()
    assert swept <= found.norm * (1 + 1e-5), (swept, found.norm)
    assert found.norm <= found.gamma * 1.001


@pytest.mark.parametrize("seed", [3, 4, 7])
def test_below_the_least_gamma_no_controller_is_found(seed):
    n = normalise(random_problem(seed))
    least = synthesise(random_problem(seed)).gamma_least
    assert solve_at(n, 0.995 * least).why is not None
    assert solve_at(n, 1.005 * least).why is None


def test_a_scalar_problem_has_the_gamma_of_the_textbook():
    # x' = x + w1 + u, z = [x, u], y = x + w2: state feedback alone needs gamma > 1 and X =
    # 1 + sqrt(1 + (1 - 1/g^2)) over (1 - 1/g^2), Y the same by symmetry, and X Y < g^2.
    plant = StateSpace(
        np.array([[1.0]]),
        np.array([[1.0, 0.0, 1.0]]),
        np.array([[1.0], [0.0], [1.0]]),
        np.array([[0.0, 0, 0], [0, 0, 1], [0, 1, 0]]),
    )
    found = synthesise(StandardProblem(plant, 1, 1), tolerance=1e-7)

    def excess(gamma):
        share = 1 - gamma**-2
        return (1 + np.sqrt(1 + share)) / share - gamma

    low, high = 1.1, 10.0
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if excess(middle) > 0 else (low, middle)
    assert found.gamma_least == pytest.approx(high, rel=1e-5)


def test_the_plants_own_direct_term_is_taken_out_of_the_controller():
    problem = random_problem(5)
    plant = problem.plant
    D = plant.D.copy()
    D[-problem.n_measured :, -problem.n_controls :] = 0.0
    without = StandardProblem(
        StateSpace(plant.A, plant.B, plant.C, D), problem.n_measured, problem.n_controls
    )
    assert synthesise(problem).gamma_least == pytest.approx(
        synthesise(without).gamma_least, rel=1e-9
    )
    gamma = 2.0 * synthesise(problem).gamma_least
    loops = [
        close(one.plant, central_controller(normalise(one), solve_at(normalise(one), gamma)))
        for one in (problem, without)
    ]
    rates = np.array([0.1, 1.0, 10.0])
    np.testing.assert_allclose(loops[0].at(rates), loops[1].at(rates), rtol=1e-6, atol=1e-9)


def test_back_off_keeps_the_controllers_poles_slow():
    near = synthesise(weighted(inca_plant(), USUAL), back_off=1e-5, tolerance=1e-9)
    away = synthesise(weighted(inca_plant(), USUAL), back_off=BACK_OFF)
    ratio = near.controller.poles().real.min() / away.controller.poles().real.min()
    assert ratio > 5, ratio


def test_a_control_without_a_cost_is_refused():
    plant = random_problem(1).plant
    D = plant.D.copy()
    D[:, -1] = 0.0
    problem = StandardProblem(StateSpace(plant.A, plant.B, plant.C, D), 1, 1)
    with pytest.raises(ValueError, match="D12 has rank below 1"):
        normalise(problem)


@pytest.mark.slow
def test_slycot_finds_the_same_gammas():
    slycot = pytest.importorskip("slycot")
    for seed in range(12):
        problem = random_problem(seed)
        found = synthesise(problem, tolerance=1e-5)
        plant = problem.plant
        with np.errstate(all="ignore"):
            outside = slycot.sb10ad(
                plant.order, plant.n_inputs, plant.n_outputs, problem.n_controls,
                problem.n_measured, 2 * found.gamma_least,
                *[getattr(plant, key).copy() for key in "ABCD"], job=1, gtol=1e-5,
            )[0]  # fmt: skip
        assert found.gamma_least <= outside * (1 + 1e-3), (seed, found.gamma_least, outside)
