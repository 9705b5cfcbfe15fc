"""When homing takes a fit, doubts it or gives it up: both sides of each limit."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.files.documents import DataError
from freeswing.homing import best_fit, doubted_geometry, home, simulated_acquisition, swivel_advice
from freeswing.homing.best_fit import PLAIN, ROBUST
from freeswing.homing.guess_from_tensions import _weight_N
from freeswing.homing.homing_files import Homing, ReadingNoise, Readings
from freeswing.homing.reading_mistakes import suspect_readings
from freeswing.homing.simulated_acquisition import PERFECT, simulate_acquisition
from tests.paper_robots import LARGEST_N, START_N, bologna_3


def solution(squares, cost: float = 0.0) -> SimpleNamespace:
    """A converged fit whose poses leave these squares."""
    residuals = np.sqrt(np.asarray(squares, dtype=float))[:, None]
    return SimpleNamespace(
        converged=True, linearization=SimpleNamespace(residuals=residuals), cost=cost,
        blocks=None, border=None,
    )  # fmt: skip


@pytest.mark.parametrize(("square", "good"), [(8.2, True), (9.8, False)])
def test_squares_that_noise_leaves(square, good) -> None:
    problem = SimpleNamespace(degrees=10)
    assert PLAIN.explains(solution([square] * 10), problem) == good


@pytest.mark.parametrize(("wild", "good"), [(0, True), (1, True), (2, False)])
def test_a_wrong_row_in_ten_is_no_wrong_start(wild, good) -> None:
    problem = SimpleNamespace(degrees=10)
    assert ROBUST.explains(solution([1.0] * (10 - wild) + [1e6] * wild), problem) == good


@pytest.mark.parametrize(("cost_by_degrees", "near"), [(0.45e4, True), (0.55e4, False)])
def test_a_geometry_that_is_off_and_a_start_that_is_wrong(monkeypatch, cost_by_degrees, near):
    """Half the sum of squares a degree of freedom; beyond, other starts are looked for."""
    found = solution([1e6] * 5, cost=10 * cost_by_degrees)
    problem = SimpleNamespace(degrees=10, finish=lambda *_: "near")
    homing = SimpleNamespace(noise=None, robot=SimpleNamespace(n_cables=3))
    monkeypatch.setattr(best_fit, "_solve_from", lambda *_: found)
    monkeypatch.setattr(best_fit, "many_starts", lambda *_: np.zeros((0, 6)))
    monkeypatch.setattr(best_fit, "guess_widely", lambda *_: [])
    monkeypatch.setattr(best_fit, "likely_mistake", lambda *_: "with another sign")
    if near:
        assert best_fit.best_fit(problem, homing, [], None) == "near"
    else:
        with pytest.raises(DataError, match="from no start pose, but do with another sign"):
            best_fit.best_fit(problem, homing, [], None)


@pytest.mark.parametrize(("chi_square", "doubted"), [(37.0, False), (44.0, True)])
def test_a_fit_whose_geometry_is_doubted(monkeypatch, chi_square, doubted) -> None:
    """Ten degrees of freedom: four times the noise is more than unlucky readings leave."""
    readings = Readings(np.zeros((9, 3)), np.zeros((9, 3)))
    homing = Homing(bologna_3(), readings, START_N, LARGEST_N, ReadingNoise(stated=True))
    fit = SimpleNamespace(chi_square=chi_square, degrees=10, cost=0.0, poses=np.zeros((9, 6)))
    asked = []

    class Doubted:
        def __init__(self, homing, model, geometry):
            asked.append(geometry is not None)

        def start_border(self, pose):
            return None

        def solve(self, *_):
            return None

        def finish(self, *_):
            return SimpleNamespace(cost=1.0, geometry_std=None)

    monkeypatch.setattr(home, "guess_poses", lambda *_: [np.zeros((9, 6))])
    monkeypatch.setattr(home, "model_for", lambda *_: None)
    for where in (home, doubted_geometry):
        monkeypatch.setattr(where, "StartProblem", Doubted)
    monkeypatch.setattr(home, "best_fit", lambda *_: fit)
    assert home.find_start(homing) is fit
    assert any(asked) == doubted


@pytest.mark.parametrize(("weight", "told"), [(0.56, True), (0.64, False)])
def test_readings_that_lost_weight_are_told(weight, told) -> None:
    weights = np.ones((3, 6))
    weights[1, 4] = weight
    fit = SimpleNamespace(length_m=np.zeros(3), weights=weights, residuals=np.zeros((3, 6)))
    assert [one["column"] for one in suspect_readings(fit)] == (["dl2_m"] if told else [])


def test_where_the_loss_of_a_wrong_reading_bends() -> None:
    """A length 15 mm off, 30 deviations: its row loses what lies beyond three of them."""
    robot, noise = bologna_3(), ReadingNoise(stated=True)
    made = simulate_acquisition(robot, START_N, LARGEST_N, 61, PERFECT, np.random.default_rng(0))
    length = np.array(made.readings.length_m)
    length[12, 1] += 30.0 * noise.length_m
    readings = Readings(made.readings.sigma_rad, length)
    fit = home.find_start(Homing(robot, readings, START_N, LARGEST_N, noise))
    others = np.delete(np.arange(61), 12)
    assert fit.weights[12].min() == pytest.approx(0.43, abs=0.05), fit.weights[12]
    assert (fit.weights[others] == 1.0).all(), np.argwhere(fit.weights < 1.0)


@pytest.mark.parametrize(
    ("arm_m", "reach_m", "radius_m", "clear"),
    [
        (0.165, 1.0, 0.01, True),
        (0.135, 1.0, 0.01, False),
        (0.33, 1.0, 0.1, True),
        (0.27, 1.0, 0.1, False),
    ],
)
def test_a_cable_that_keeps_away_from_its_swivel_axis(arm_m, reach_m, radius_m, clear) -> None:
    """Its distance from the axis over its length, and over the pulley's radius."""
    robot = SimpleNamespace(
        attachments_m=np.zeros((1, 3)), entries_m=np.zeros((1, 3)),
        swivel_axes=np.eye(3)[None], radii_m=np.array([radius_m]),
    )  # fmt: skip
    pose = np.array([[arm_m, 0.0, np.sqrt(reach_m**2 - arm_m**2), 0.0, 0.0, 0.0]])
    assert swivel_advice._is_clear(robot, pose) == clear


@pytest.mark.parametrize(("share", "turned"), [(0.985, True), (0.995, False)])
def test_an_axis_is_turned_for_one_per_cent(monkeypatch, share, turned) -> None:
    robot = SimpleNamespace(n_cables=1)
    other = SimpleNamespace(n_cables=1)
    quality = {
        id(robot): swivel_advice.HomingQuality(1.0, 1.0, 1.0),
        id(other): swivel_advice.HomingQuality(share, 1.0, 1.0),
    }
    monkeypatch.setattr(swivel_advice, "homing_quality", lambda one, _: quality[id(one)])
    monkeypatch.setattr(swivel_advice, "_with_axis", lambda *_: other)
    found, _ = swivel_advice.better_axes(robot, ReadingNoise(), lambda *_: None)
    assert (found is other) == turned


def test_start_tensions_of_an_unknown_mass_hold_it_one_and_a_half_times() -> None:
    """Leaning cables pull aside as well: 150 N carry 100 N."""
    robot = SimpleNamespace(
        gravity_m_s2=np.array([0.0, 0.0, -9.8]), platform=SimpleNamespace(mass_kg=None)
    )
    assert 95.0 < _weight_N(robot, np.full(3, 50.0)) < 105.0


def test_a_slack_cable_still_pulls_by_a_fiftieth_of_the_weight(monkeypatch) -> None:
    """Tensions that repeat to a thousand newtons would push as often as they pull."""
    settled, asked = simulated_acquisition._settle, []

    def settle(energy, pulls, *pushes):
        asked.append(pulls)
        return settled(energy, asked[0], *pushes)

    monkeypatch.setattr(simulated_acquisition, "_settle", settle)
    robot, rng = bologna_3(), np.random.default_rng(0)
    rough = replace(PERFECT, repeatability_N=1000.0)
    simulate_acquisition(robot, START_N, LARGEST_N, 9, rough, rng)
    assert asked[0].min() > 0.05
    assert 0.018 < asked[1].min() < 0.022
