"""From which numbers on a file is refused or read another way, on both sides of every limit."""

import re

import numpy as np
import pytest

from freeswing.cdpr.files.drive_csv import _Table
from freeswing.cdpr.files.mocap.fill_values import without_gaps
from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.files.trajectory_files import read_recording, read_trajectory, write_c3d
from freeswing.cdpr.measured.marker_recording import MarkerRecording
from tests.cdpr.driven_robots import INCA
from tests.cdpr.files.test_mocap_exports import long_trc
from tests.cdpr.files.test_robot_file import CABLE, HEAD


def refusal(read, path) -> str:
    """What a reader says of a file; empty where it takes it."""
    try:
        read(path)
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(("length", "refused"), [(1.019, False), (1.021, True), (0.979, True)])
@pytest.mark.parametrize("name", ["a.csv", "a.tum"])
def test_a_quaternion_is_off_by_two_per_cent_at_most(tmp_path, name, length, refused):
    comma, head = ("," if name == "a.csv" else " "), "t_s,x_m,y_m,z_m,qw,qx,qy,qz\n"
    first = [length, 0, 0, 0] if name == "a.csv" else [0, 0, 0, length]
    rows = [comma.join(map(str, [k / 10, 1, 2, 3, *first])) for k in range(3)]
    (tmp_path / name).write_text((head if name == "a.csv" else "") + "\n".join(rows) + "\n")
    said = refusal(read_trajectory, tmp_path / name)
    assert ("quaternion's length" in said) == refused, said


@pytest.mark.parametrize(("spread", "refused"), [(2.45, False), (2.55, True)])
def test_angles_swing_over_two_and_a_half_radians_at_most(tmp_path, spread, refused):
    rows = [f"{k / 10},0,0,0,{k % 2 * spread},0,0" for k in range(20)]
    head = "t_s,x_m,y_m,z_m,phi_rad,theta_rad,chi_rad"
    (tmp_path / "a.csv").write_text("\n".join([head, *rows, ""]))
    said = refusal(read_trajectory, tmp_path / "a.csv")
    assert ("is the column in degrees?" in said) == refused, said


@pytest.mark.parametrize(("rate", "refused"), [(100.09, False), (100.12, True)])
def test_rate_and_stamps_of_trc_agree_to_a_thousandth(tmp_path, rate, refused):
    """And to twice the last digit of the stamps over four seconds, a ten thousandth here."""
    rows = long_trc(rate).replace("\t400\t2", "\t4000\t2").split("\n")[:6]
    rows += [f"{k + 1}\t{k / 100:.3f}\t{k}\t2\t3\t4\t5\t6" for k in range(4000)]
    (tmp_path / "a.trc").write_text("\n".join([*rows, ""]))
    assert ("but the Time column" in refusal(read_recording, tmp_path / "a.trc")) == refused


def test_fill_values_begin_with_six_nines():
    """A million in any unit is no place in a laboratory; a hundred thousand may be one."""
    rows = np.ones((5, 1, 3))
    rows[1], rows[2], rows[3] = 1e5, 999999.0, 999998.0
    found, notes = without_gaps(rows, ("P",))
    assert np.isnan(found[:, 0, 0]).tolist() == [False, False, True, False, False]
    assert "1 samples of P" in notes[0]


@pytest.mark.parametrize(("spare", "refused"), [(28, False), (32, True)])
def test_a_c3d_file_may_have_room_for_a_tenth_more(tmp_path, spare, refused):
    """Room of so many frames at the end of 300, which take 48 bytes each."""
    points = np.random.default_rng(0).normal(size=(300, 3, 3))
    path = tmp_path / "a.c3d"
    write_c3d(path, MarkerRecording(np.arange(300) / 100.0, ("P", "A", "B"), points))
    content = path.read_bytes()
    begin = 512 * (int.from_bytes(content[16:18], "little") - 1)
    path.write_bytes(content[: begin + 48 * 300] + bytes(48 * spare))
    assert ("contradiction" in refusal(read_recording, path)) == refused


@pytest.mark.parametrize(("norm", "refused"), [(1.019, False), (1.021, True), (0.979, True)])
def test_a_camera_s_quaternion_is_off_by_two_per_cent_at_most_too(norm, refused):
    table = _Table("a.csv", np.zeros((1, 7)), np.array([2]))
    pose = np.array([[0.0, 0.0, 0.0, norm, 0.0, 0.0, 0.0]])
    assert ("norm is not 1" in refusal(table.poses, pose)) == refused


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("Lx_m", 398.0, ""),
        ("Lx_m", 402.0, "this looks like mm"),
        ("drum_m", 0.49, ""),
        ("drum_m", 0.51, "is no drum"),
    ],
)
def test_a_driven_robot_is_no_larger_than_a_hall(tmp_path, key, value, words):
    text = re.sub(rf"(?m)^{key} = \S+", f"{key} = {value}", INCA.read_text())
    (tmp_path / "robot.toml").write_text(text)
    said = refusal(read_robot, tmp_path / "robot.toml")
    assert bool(said) == bool(words), said
    assert words in said


@pytest.mark.parametrize(("gravity", "refused"), [(99.0, False), (101.0, True)])
def test_gravity_of_a_hundred_is_none(tmp_path, gravity, refused):
    head = HEAD.replace("-9.80665", str(-gravity))
    text = head + "".join(CABLE.format(name=name) for name in "1234")
    (tmp_path / "robot.toml").write_text(text)
    assert ("no gravity" in refusal(read_robot, tmp_path / "robot.toml")) == refused


@pytest.mark.parametrize(("product", "refused"), [(0.9e-6, False), (1.1e-6, True)])
def test_swivel_axes_are_perpendicular_to_a_millionth(tmp_path, product, refused):
    tilted = CABLE.replace("swivel_y = [-0.0, -0, -1]", f"swivel_y = [0.0, {product}, -1]")
    text = HEAD + "".join(tilted.format(name=name) for name in "1234")
    (tmp_path / "robot.toml").write_text(text)
    assert ("not perpendicular" in refusal(read_robot, tmp_path / "robot.toml")) == refused


@pytest.mark.parametrize(("n", "refused"), [(24, False), (25, True)])
def test_driven_robots_have_up_to_24_cables(tmp_path, n, refused):
    head, first, *_ = re.split(r"(?m)^(?=\[\[cables\]\])", INCA.read_text())
    cables = [first.replace('name = "1"', f'name = "c{k}"') for k in range(n)]
    (tmp_path / "robot.toml").write_text(head + "".join(cables))
    said = refusal(read_robot, tmp_path / "robot.toml")
    assert (f"{n} cables" in said or "24" in said) == refused, said
