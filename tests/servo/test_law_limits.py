"""How fast filters, observers and anti-windup are, both sides of each number, on made plants."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.files.problems import InputError
from freeswing.servo.design.family import _makers
from freeswing.servo.design.lqg import design_lqg
from freeswing.servo.design.pid import task_pid
from freeswing.servo.files.task_file import Task, Watch
from freeswing.servo.files.wrench_file import _check_rows
from freeswing.servo.loop.anti_windup import LinearRegulator
from freeswing.servo.loop.closed_loop import _Brain, current_bounds
from freeswing.servo.loop.trials import hardships
from freeswing.servo.synthesis import gamma_search
from freeswing.servo.synthesis.state_space import StateSpace

SPEEDS = np.full(6, 3.0)


def filters(controller: StateSpace) -> np.ndarray:
    """Rates of the derivatives' filters, rad/s, (6,)."""
    return -controller.A.diagonal()[6:]


@pytest.mark.parametrize(("own", "decides"), [(28.5, False), (31.5, True)])
def test_a_derivative_is_filtered_ten_times_faster_than_the_loop(own, decides) -> None:
    """The robot's own resonances ask for a rate that is a little lower or higher than that."""
    rates = filters(task_pid(np.eye(6), SPEEDS, np.full(6, own)))
    assert (rates == own).all() == decides, rates


@pytest.mark.parametrize(("mode", "decides"), [(2.85, False), (3.15, True)])
def test_orientation_is_filtered_ten_times_faster_than_the_fastest_mode(mode, decides) -> None:
    """Of the robot, beside a loop of 3 rad/s."""
    modes = np.r_[np.ones(11), mode]
    plant = SimpleNamespace(system=SimpleNamespace(poles=lambda: 1j * modes), mass=np.eye(6))
    rates = filters(_makers(plant, np.eye(6))["pid"](SPEEDS))
    assert (rates[:3] == rates[3:]).all() == (not decides), rates
    assert rates[3:] == pytest.approx(10.0 * max(mode, 3.0))


def test_the_kalman_filter_is_twice_as_fast_as_the_regulator() -> None:
    """A free body: Butterworth's pattern has this radius on both sides."""
    zero, one = np.zeros((6, 6)), np.eye(6)
    plant = StateSpace(
        np.block([[zero, one], [zero, zero]]), np.vstack([zero, one]), np.hstack([one, zero]), zero
    )
    found = design_lqg(plant, one, SPEEDS)
    observed = np.linalg.eigvals(plant.A - found.observer @ plant.C)
    assert np.abs(observed) / 3.0 == pytest.approx(np.full(12, 2.0), rel=0.02)


@pytest.mark.parametrize(("off", "refused"), [(0.00095, False), (0.00105, True)])
def test_quaternions_of_three_decimals_are_read(off, refused) -> None:
    for length in (1.0 + off, 1.0 - off):
        row = np.r_[0.0, 0.0, 0.0, length, np.zeros(9)][None]
        asked = "w.csv", row, np.array([2]), np.ones(3), 1.0
        if refused:
            with pytest.raises(InputError, match="line 2: the quaternion's length"):
                _check_rows(*asked)
        else:
            _check_rows(*asked)


@pytest.mark.parametrize(("spring_N", "pulls"), [(9.5, True), (10.5, False)])
def test_cables_are_wished_at_ten_newtons(spring_N, pulls) -> None:
    """A motor pulls where its spring pulls with less, and lets go where it pulls with more."""
    here = SimpleNamespace(springs_N=np.array([spring_N]))
    motors = SimpleNamespace(
        current_limits_A=np.array([[-1.0, 1.0]]), tension_limits_N=np.array([[1.0, 50.0]]),
        tension_per_A=np.array([20.0]),
    )  # fmt: skip
    wish = current_bounds(here, motors)[2]
    assert (wish[0] > 0.0) == pulls, wish


def test_encoder_rates_are_smoothed_over_five_milliseconds() -> None:
    """Encoders that begin to turn at 1 rad/s: 1 - 1/e of it is believed after that long."""
    brain = _Brain.__new__(_Brain)
    brain._rates, brain._angles = np.zeros(1), np.zeros(1)
    seen = [0.0]
    for step in range(1, 7):
        brain._follow(np.array([1e-3 * step]))
        seen.append(float(brain._rates[0]))
    assert seen[4] < 0.6 < seen[5] == pytest.approx(0.632, abs=0.02)


def test_windup_is_let_go_by_the_golden_ratio() -> None:
    """An integrator that asks for 1 and is given nothing trusts what was applied as its error."""
    one = np.ones((1, 1))
    regulator = LinearRegulator(StateSpace(one, one, one, 0.0 * one, 0.001))
    regulator.wrench(np.ones(1), np.zeros(1), True)
    regulator.applied(np.zeros(1))
    assert regulator.wrench(np.zeros(1), np.zeros(1), True)[0] == pytest.approx(1.0)
    regulator.applied(np.zeros(1))
    left = regulator.wrench(np.zeros(1), np.zeros(1), True)[0]
    assert left == pytest.approx(1.5 - 0.5 * np.sqrt(5.0), abs=0.01), left


def test_a_camera_of_fifteen_milliseconds_is_one_of_the_hardships() -> None:
    """The goals ask for it; a period of the camera is not touched."""
    model = SimpleNamespace(
        names=("mass_kg",), declared=np.ones(1), theta=lambda changes: changes,
        robot=SimpleNamespace(cables=[SimpleNamespace(name="a")], drive=None),
    )  # fmt: skip
    watch = Watch()
    watch = replace(watch, camera=replace(watch.camera, period_s=0.02, latency_s=0.001))
    late = hardships(model, Task(np.zeros(1), np.zeros((1, 6)), 1.0, watch), feed=False, seed=0)[0]
    assert late.name == "15 ms of latency"
    assert late.task.watch.camera.latency_s == pytest.approx(0.015)
    assert late.task.watch.camera.period_s == 0.02


def test_a_controller_stays_two_per_cent_above_the_least_gamma(monkeypatch) -> None:
    """Nearer, a pole runs away; farther, the goals are given up for nothing."""
    tried = []

    def solve_at(_, gamma):
        tried.append(gamma)
        return SimpleNamespace(why=None, gamma=gamma)

    monkeypatch.setattr(gamma_search, "normalise", lambda problem: None)
    monkeypatch.setattr(gamma_search, "_bracket", lambda n: (None, None))
    monkeypatch.setattr(gamma_search, "_narrowed", lambda *_: (5.0, "made"))
    monkeypatch.setattr(gamma_search, "solve_at", solve_at)
    monkeypatch.setattr(gamma_search, "central_controller", lambda *_: None)
    monkeypatch.setattr(gamma_search, "close", lambda *_: None)
    norm = SimpleNamespace(value=5.0, rate_rad_s=1.0)
    monkeypatch.setattr(gamma_search, "hinf_norm", lambda _: norm)
    found = gamma_search.synthesise(SimpleNamespace(plant=None))
    assert tried == [found.gamma]
    assert 1.017 < found.gamma / found.gamma_least < 1.023
