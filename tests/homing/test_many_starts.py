"""Tensions that are far off, units and signs that are wrong, one absurd reading."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.files.problems import DataError
from freeswing.homing.guess_from_tensions import TensionEnergy, acquisition_tensions
from freeswing.homing.home import find_start
from freeswing.homing.homing_files import Homing, Readings
from freeswing.homing.many_starts import far_rows, many_starts
from freeswing.homing.rest_readings import RestModel
from tests.paper_robots import LARGEST_N, PERTURBED_N, START, START_N, bologna_3


def exact_homing(told_N: np.ndarray, count: int = 31) -> Homing:
    """Readings without noise from 40 N in each cable, with other tensions told."""
    robot = bologna_3()
    weight = 8.0 * float(np.linalg.norm(robot.gravity_m_s2))
    pulls = acquisition_tensions(START_N, LARGEST_N, count) / weight
    rest = TensionEnergy(robot).settle(np.tile(START, (count, 1)), pulls)
    values = RestModel(robot, (3, 4, 5)).evaluate(rest.poses).values
    changes = values[:, :6] - values[0, :6]
    return Homing(robot, Readings(changes[:, :3], changes[:, 3:]), told_N, LARGEST_N)


@pytest.mark.parametrize(
    "told_N",
    [
        PERTURBED_N,
        pytest.param(np.array([80.0, 160.0, 20.0]), marks=pytest.mark.slow),
        pytest.param(np.array([40000.0, 40.0, 40.0]), marks=pytest.mark.slow),
    ],
)
def test_tensions_far_off_still_lead_to_the_start(told_N: np.ndarray) -> None:
    fit = find_start(exact_homing(told_N))
    np.testing.assert_allclose(fit.poses[0], START, atol=2e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("turn", "stretch", "told"),
    [(np.rad2deg(1), 1.0, "dsigma are degrees"), (1.0, 1e3, "dl are millimetres")],
)
def test_a_wrong_unit_is_named(turn: float, stretch: float, told: str) -> None:
    right = exact_homing(START_N)
    readings = right.readings
    wrong = Readings(turn * readings.sigma_rad, stretch * readings.length_m)
    with pytest.raises(DataError, match=told):
        find_start(replace(right, readings=wrong))


@pytest.mark.slow
def test_one_absurd_reading_is_named_by_its_line() -> None:
    right = exact_homing(START_N)
    sigma = np.array(right.readings.sigma_rad)
    sigma[7, 1] = 2.0
    with pytest.raises(DataError, match="lines 9,"):
        find_start(replace(right, readings=Readings(sigma, right.readings.length_m)))


def test_starts_are_distinct_stable_rests_at_many_tensions() -> None:
    energy = TensionEnergy(bologna_3())
    starts = many_starts(energy, 3)
    apart = np.abs(starts[:, None] - starts[None]).max(axis=-1) + 9 * np.eye(len(starts))
    assert len(starts) > 50
    assert apart.min() > 5e-4, apart.min()


def test_far_rows_hold_the_start_and_the_extremes() -> None:
    readings = exact_homing(START_N).readings
    rows = far_rows(readings)
    table = np.hstack([readings.sigma_rad, readings.length_m])
    assert rows[0] == 0
    assert np.linalg.norm(table, axis=1).argmax() in rows
