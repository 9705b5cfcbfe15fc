"""Homing: exact readings, noisy readings, wrong readings, too few of them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.files.robot_file import write_robot
from freeswing.homing.best_fit import best_fit, model_for
from freeswing.homing.fit_start_pose import StartProblem
from freeswing.homing.guess_from_tensions import TensionEnergy, guess_poses
from freeswing.homing.home import find_start, home
from freeswing.homing.homing_files import GeometryNoise, Homing, ReadingNoise, Readings
from freeswing.homing.simulated_acquisition import (
    PERFECT,
    AcquisitionErrors,
    default_tensions,
    simulate_acquisition,
    simulate_homing,
)
from tests.paper_robots import LARGEST_N, PERTURBED_N, START_N, bologna_3, bologna_4

REAL = AcquisitionErrors()
STATED = ReadingNoise(REAL.sigma_std_rad, REAL.length_std_m, REAL.statics, stated=True)
EXACT = ReadingNoise(stated=True)


def acquired(robot, n_poses, errors, seed=0, start=START_N, largest=LARGEST_N):
    rng = np.random.default_rng(seed)
    return simulate_acquisition(robot, start, largest, n_poses, errors, rng)


def encoders(acquisition):
    return Readings(acquisition.readings.sigma_rad, acquisition.readings.length_m)


@pytest.mark.parametrize("count", [12, 60, 120, 372])
def test_the_papers_example_is_recovered_from_its_perturbed_guess(count):
    robot = bologna_3()
    made = acquired(robot, count + 1, PERFECT)
    fit = find_start(Homing(robot, encoders(made), PERTURBED_N, LARGEST_N, EXACT))
    error = np.abs(fit.poses[0] - made.poses[0]).max()
    assert error < 1e-9, f"start pose off by {error:.1e}"
    off = max(
        np.abs(fit.sigma_rad - made.sigma_rad[0]).max(),
        np.abs(fit.length_m - made.length_m[0]).max(),
    )
    assert off < 1e-9, f"start angles and lengths off by {off:.1e}"


def test_a_four_cable_robot_is_homed_too():
    robot = bologna_4()
    start, largest = default_tensions(robot)
    made = acquired(robot, 25, PERFECT, start=start, largest=largest)
    fit = find_start(Homing(robot, encoders(made), 1.15 * start, largest, EXACT))
    error = np.abs(fit.poses[0] - made.poses[0]).max()
    assert error < 1e-9, f"start pose off by {error:.1e}"


def test_errors_agree_with_the_covariance():
    robot, runs = bologna_3(), 16
    squares, lengths = [], []
    for seed in range(runs):
        made = acquired(robot, 61, REAL, seed)
        fit = find_start(Homing(robot, encoders(made), START_N, LARGEST_N, STATED))
        error = fit.poses[0] - made.poses[0]
        squares.append(error @ np.linalg.solve(fit.pose_covariance, error))
        lengths.append(1e3 * np.linalg.norm(error[:3]))
    mean = np.mean(squares) / 6
    # A chi-square of 6 degrees, 16 times: its mean is 1 within 3 sqrt(2 / 96) = 0.43; errors of
    # counting encoders are uniform and the stated noise inflated where the fit is bad: a bit less.
    assert 0.5 < mean < 1.45, f"squared errors are {mean:.2f} times the covariance"
    assert np.max(lengths) < 3, f"worst position error {np.max(lengths):.2f} mm"


def test_unstated_noise_is_found_from_the_readings():
    robot = bologna_3()
    made = acquired(robot, 241, REAL)
    fit = find_start(Homing(robot, encoders(made), START_N, LARGEST_N))
    ratio = fit.noise.length_m / REAL.length_std_m
    assert 0.8 < ratio < 1.25, f"length noise {ratio:.2f} times the true one"
    error = np.linalg.norm(fit.poses[0, :3] - made.poses[0, :3])
    assert error < 4 * np.sqrt(np.trace(fit.pose_covariance[:3, :3])), f"{error * 1e3:.2f} mm"


def test_wrong_readings_lose_their_weight():
    robot = bologna_3()
    made = acquired(robot, 61, REAL)
    length = made.readings.length_m.copy()
    length[[7, 20, 33], [0, 1, 2]] += 0.05
    readings = Readings(made.readings.sigma_rad, length)
    fit = find_start(Homing(robot, readings, START_N, LARGEST_N, STATED))
    error = np.linalg.norm(fit.poses[0, :3] - made.poses[0, :3])
    assert error < 2e-3, f"three readings 50 mm off move the start by {error * 1e3:.2f} mm"
    heaviest = fit.weights[[7, 20, 33], [3, 4, 5]].max()
    assert heaviest < 0.1, f"a wrong reading keeps a weight of {heaviest:.2f}"


def test_missing_readings_are_left_out():
    robot = bologna_3()
    made = acquired(robot, 61, PERFECT)
    sigma, length = made.readings.sigma_rad.copy(), made.readings.length_m.copy()
    sigma[5:20, 1], length[30:40, 2] = np.nan, np.nan
    fit = find_start(Homing(robot, Readings(sigma, length), PERTURBED_N, LARGEST_N, EXACT))
    error = np.abs(fit.poses[0] - made.poses[0]).max()
    assert error < 1e-9, f"start pose off by {error:.1e}"


def test_tensions_and_an_inclinometer_sharpen_the_start():
    robot = bologna_3()
    made = acquired(robot, 25, REAL)
    plain = find_start(Homing(robot, encoders(made), START_N, LARGEST_N, STATED))
    turn = made.poses[:, 3:]
    from freeswing.cdpr.rotation import matrix_from_angles

    up = matrix_from_angles(turn)[:, 2, :]
    noise = 2e-4 * np.random.default_rng(1).standard_normal((25, 2))
    tilt = noise + np.stack(
        [np.arctan2(up[:, 1], up[:, 2]), np.arctan2(-up[:, 0], np.hypot(up[:, 1], up[:, 2]))], 1
    )
    pulls = made.tensions_N + 0.2 * np.random.default_rng(2).standard_normal((25, 3))
    readings = replace(encoders(made), tension_N=pulls, tilt_rad=tilt)
    stated = replace(STATED, tension_N=0.2, tilt_rad=2e-4)
    fit = find_start(Homing(robot, readings, START_N, LARGEST_N, stated))
    shrink = np.sqrt(np.trace(fit.pose_covariance) / np.trace(plain.pose_covariance))
    assert shrink < 0.95, f"standard deviation only {shrink:.2f} times that of the encoders alone"
    error = fit.poses[0] - made.poses[0]
    square = error @ np.linalg.solve(fit.pose_covariance, error)
    assert square < 27, f"squared error {square:.1f} (0.01 % of a chi-square of 6 lies beyond 27)"


def test_a_wrong_attachment_is_found_where_the_geometry_is_said_to_be_doubtful():
    robot = bologna_3()
    made = acquired(robot, 121, replace(REAL, length_std_m=1e-4))
    cables = list(robot.cables)
    cables[1] = replace(cables[1], attachment_m=cables[1].attachment_m + np.array([0, 0.006, 0]))
    wrong = replace(robot, cables=tuple(cables))
    noise = replace(STATED, length_m=1e-4)
    homing = Homing(wrong, encoders(made), START_N, LARGEST_N, noise)
    energy = TensionEnergy(wrong)
    guesses = guess_poses(homing, energy)
    problem = StartProblem(homing, model_for(homing, guesses[0][0]), None)
    held = best_fit(problem, homing, guesses, energy)
    freed = find_start(Homing(wrong, encoders(made), START_N, LARGEST_N, noise, GeometryNoise()))
    before, after = (np.linalg.norm(f.poses[0, :3] - made.poses[0, :3]) for f in (held, freed))
    assert freed.chi_square < 2 * freed.degrees, f"{freed.chi_square / freed.degrees:.1f}"
    assert held.chi_square > 4 * held.degrees, f"{held.chi_square / held.degrees:.1f}"
    assert after < before, f"error {before * 1e3:.2f} mm became {after * 1e3:.2f} mm"
    error = freed.poses[0] - made.poses[0]
    square = error @ np.linalg.solve(freed.pose_covariance, error)
    assert square < 27, f"squared error {square:.1f} times the covariance"


def test_poses_that_do_not_differ_determine_nothing():
    robot = bologna_3()
    readings = Readings(np.zeros((20, 3)), np.zeros((20, 3)))
    with pytest.raises(DataError, match=r"determine \d of the 6|not found"):
        find_start(Homing(robot, readings, START_N, START_N, EXACT))


def test_two_poses_are_refused():
    readings = Readings(np.zeros((2, 3)), np.zeros((2, 3)))
    with pytest.raises(DataError, match="2 static poses, at least 3"):
        find_start(Homing(bologna_3(), readings, START_N, LARGEST_N))


def test_readings_that_do_not_change_determine_no_start():
    readings = Readings(np.zeros((9, 3)), np.zeros((9, 3)))
    with pytest.raises(DataError, match="record more"):
        find_start(Homing(bologna_3(), readings, np.full(3, 2.0), LARGEST_N))


def test_a_simulated_session_is_homed_from_its_files(tmp_path):
    robot_file = tmp_path / "robot.toml"
    write_robot(robot_file, bologna_3())
    path = simulate_homing(robot_file, tmp_path / "made", n_poses=37, seed=4)
    written = home(path)
    truth = json.loads((tmp_path / "made" / "truth.json").read_text())
    error = np.subtract(written["start_pose"]["position_m"], truth["start_pose"]["position_m"])
    spread = np.array(written["start_pose_std"]["position_m"])
    assert (np.abs(error) < 5 * spread).all(), f"errors {error} with std {spread}"


@pytest.mark.slow
def test_advised_axes_home_better():
    from freeswing.homing.swivel_advice import better_axes, homing_quality

    robot = bologna_3()
    declared = homing_quality(robot, EXACT)
    _, advised = better_axes(robot, EXACT, lambda *_: None)
    assert declared is not None
    assert advised is not None
    gain = declared.position_std_m / advised.position_std_m
    assert gain > 1.1, f"the advised axes gain a factor of {gain:.2f}"
