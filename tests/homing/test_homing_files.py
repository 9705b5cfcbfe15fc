"""homing.toml and readings.csv: what is wrong with them is said."""

import numpy as np
import pytest

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.robot_file import write_robot
from freeswing.homing.homing_files import (
    Homing,
    ReadingNoise,
    Readings,
    read_homing,
    read_readings,
    write_homing,
)
from tests.paper_robots import bologna_3

HEADER = "dsigma1_rad,dsigma2_rad,dsigma3_rad,dl1_m,dl2_m,dl3_m"
TOML = """format = "freeswing-homing/1"
robot = "robot.toml"
readings = "readings.csv"
start_tensions_N = [40, 40, 40]
max_tensions_N = [80, 80, 80]
"""


def folder(tmp_path, toml=TOML, table=f"{HEADER}\n0,0,0,0,0,0\n0.1,,0,0,0,0.2\n"):
    write_robot(tmp_path / "robot.toml", bologna_3())
    (tmp_path / "homing.toml").write_text(toml)
    (tmp_path / "readings.csv").write_text(table)
    return tmp_path / "homing.toml"


def test_written_sessions_read_back(tmp_path):
    rng = np.random.default_rng(0)
    sigma, length = rng.standard_normal((2, 5, 3))
    sigma[0] = length[0] = 0
    sigma[3, 1] = np.nan
    noise = ReadingNoise(1e-4, 2e-4, 3e-4, stated=True)
    readings = Readings(sigma, length, tension_N=rng.uniform(20, 60, (5, 3)))
    made = Homing(bologna_3(), readings, np.full(3, 40.0), np.full(3, 80.0), noise)
    write_robot(tmp_path / "robot.toml", made.robot)
    found = read_homing(write_homing(tmp_path, made))
    assert np.array_equal(found.readings.sigma_rad, sigma, equal_nan=True)
    assert np.array_equal(found.readings.length_m, length)
    assert np.array_equal(found.readings.tension_N, readings.tension_N)
    assert found.noise == noise


def test_an_empty_cell_is_a_missing_reading(tmp_path):
    found = read_homing(folder(tmp_path))
    assert np.isnan(found.readings.sigma_rad[1, 1])
    assert found.readings.length_m[1, 2] == 0.2
    assert not found.noise.stated


@pytest.mark.parametrize(
    ("toml", "message"),
    [
        (TOML.replace("homing/1", "homing/2"), "homing"),
        (TOML.replace("[40, 40, 40]", "[40, 40]"), "2 tensions, the robot has 3 cables"),
        (TOML.replace("[40, 40, 40]", "[40, 0, 40]"), "every cable must be taut"),
        (TOML + "speed = 3\n", "speed"),
        (TOML + "[readings_std]\nsigma_rad = 0\n", "sigma_rad"),
        (TOML.replace("readings.csv", "../readings.csv"), "leads out of"),
    ],
)
def test_a_wrong_document_is_named(tmp_path, toml, message):
    with pytest.raises(InputError, match=message):
        read_homing(folder(tmp_path, toml))


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("", "empty"),
        (HEADER, "no static pose"),
        (f"{HEADER},speed\n0,0,0,0,0,0,0\n", "speed"),
        (f"{HEADER.replace('dl3_m', 'dl2_m')}\n0,0,0,0,0,0\n", "twice"),
        (f"{HEADER[:-6]}\n0,0,0,0,0\n", "'dl3_m'\": missing|'dl3_m': missing"),
        (f"{HEADER}\n0,0,0,0,0\n", "line 2: 5 cells, the header has 6"),
        (f"{HEADER}\n0,0,0,0,0,0\n0,x,0,0,0,0\n", "line 3, dsigma2_rad: 'x' is not a number"),
        (f"{HEADER}\n0,inf,0,0,0,0\n", "not a number"),
        (f"{HEADER}\n0,0.1,0,0,0,0\n", "first row is the start pose"),
    ],
)
def test_a_wrong_table_is_named(tmp_path, table, message):
    with pytest.raises(InputError, match=message):
        read_homing(folder(tmp_path, table=table))


def test_a_carriage_return_inside_a_row_is_refused(tmp_path) -> None:
    path = tmp_path / "readings.csv"
    path.write_bytes(b"dsigma1_rad,dl1_m\n0,0\n0.1\r,0.2\n")
    with pytest.raises(InputError, match=r"save it again as CSV"):
        read_readings(path, 1)
