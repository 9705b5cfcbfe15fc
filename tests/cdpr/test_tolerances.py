"""The table of tolerances, and what robot.toml says of it."""

import dataclasses

import pytest

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.robot_file import read_robot, write_robot
from freeswing.cdpr.tolerances import Tolerances
from tests.oracle.scenes.robots import declared_robot


@pytest.mark.parametrize("field", list(Tolerances().numbers()))
def test_a_tolerance_of_nothing_is_refused_by_name(field):
    with pytest.raises(ValueError, match=field):
        Tolerances(**{field: 0.0})  # pyright: ignore[reportArgumentType]


def test_an_error_no_larger_than_a_tolerance_is_refused():
    with pytest.raises(ValueError, match="gross"):
        Tolerances(gross=1.0)


def test_robot_toml_overrides_some_and_keeps_the_others(tmp_path):
    robot = declared_robot("three-cable")
    known = Tolerances(attachment_m=2e-4, swivel_rad=0.05)
    path = tmp_path / "robot.toml"
    write_robot(path, dataclasses.replace(robot, tolerances=known))
    assert read_robot(path).tolerances == known
    write_robot(path, robot)
    assert "tolerances" not in path.read_text()
    assert read_robot(path).tolerances == Tolerances()
    assert read_robot(path).tolerances.declared == ()


def test_what_robot_toml_states_is_known_though_it_be_the_usual_value(tmp_path):
    path = tmp_path / "robot.toml"
    write_robot(path, declared_robot("three-cable"))
    path.write_text(path.read_text() + "\n[tolerances]\nentry_m = 0.001\n")
    robot = read_robot(path)
    assert robot.tolerances.declared == ("entry_m",)
    write_robot(path, robot)
    assert read_robot(path).tolerances.declared == ("entry_m",)


def test_a_wrong_tolerance_names_file_and_key(tmp_path):
    path = tmp_path / "robot.toml"
    write_robot(path, declared_robot("three-cable"))
    path.write_text(
        path.read_text() + "\n[tolerances]\nentry_m = -0.001\nentyr_m = 0.1\ngross = 0.5\n"
    )
    with pytest.raises(InputError, match=r"entry_m") as caught:
        read_robot(path)
    assert "entyr_m" in str(caught.value)
    assert "gross" in str(caught.value)
