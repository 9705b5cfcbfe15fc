import numpy as np
import pytest

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.robot_file import read_robot, write_robot
from tests.cdpr.driven_robots import INCA


def complaint(tmp_path, *changes):
    text = INCA.read_text()
    for old, new in changes:
        assert text.count(old) >= 1, old
        text = text.replace(old, new, 1)
    path = tmp_path / "robot.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_robot(path)
    return str(caught.value)


def test_table_1_and_the_corners():
    robot = read_robot(INCA)
    assert robot.n_cables == 8
    corners = np.sign(robot.entries_m)
    assert len({tuple(corner) for corner in corners}) == 8
    in_xy = robot.attachments_m[:, 2] == 0.0
    assert (in_xy == (corners.prod(axis=1) > 0)).all()
    assert np.allclose(np.linalg.norm(robot.attachments_m, axis=1), 0.138)
    assert np.allclose(robot.platform.mass_kg * robot.platform.specific_inertia_m2[0], 1.49e-4)


def test_what_is_written_is_read_again(tmp_path):
    robot = read_robot(INCA)
    write_robot(tmp_path / "robot.toml", robot)
    again = read_robot(tmp_path / "robot.toml")
    assert again.drive == robot.drive
    assert np.array_equal(again.entries_m, robot.entries_m)
    assert np.array_equal(again.attachments_m, robot.attachments_m)


def test_one_cable_of_its_own(tmp_path):
    text = INCA.read_text() + "[cables.drive]\nspring_N_m = 15.0\ncurrent_limits_A = [0.0, 2.0]\n"
    (tmp_path / "robot.toml").write_text(text)
    robot = read_robot(tmp_path / "robot.toml")
    assert robot.drive.motors[7].own == {"spring_N_m"}
    assert robot.drive.current_limits_A[7].tolist() == [0.0, 2.0]
    write_robot(tmp_path / "again.toml", robot)
    assert read_robot(tmp_path / "again.toml").drive == robot.drive


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ([('"Lx_m/2"', '"Lq_m/2"')], ["entry_m[0]", "Lq_m", "[shape] has Lx_m"]),
        ([("arm_m = 0.138", 'arm_m = "drum_m*8"'), ("drum_m = 0.0175", 'drum_m = "arm_m/8"')],
         ["defined by each other", "drum_m", "arm_m"]),
        ([("= 0.0603", "= 0.0")], ["drive.torque_constant_N_m_A", "must be > 0"]),
        ([("[0.0, 3.0]", "[3.0, 0.0]")], ["current_limits_A", "wrong way round"]),
        ([("[1.48, 18.5]", "[-1.0, 18.5]")], ["tension_limits_N", "cannot push"]),
        ([("spring_N_m = 14.4", "spring_N_m = 0.0")], ["a drum without a spring"]),
        ([("spring_drum_radius_m = 0.006\n", "")], ["a spring without its drum"]),
        ([("drum_m = 0.0175", "drum_m = 17.5")], ["drive.drum_radius_m", "mm"]),
        ([("Lx_m = 2.50", "Lx_m = 2500.0")], ["entry_m", "mm", "write metres"]),
        ([('"Lx_m/2"', '"Lx_m**2"')], ["entry_m[0]", "is not understood"]),
        ([("mass_kg = 0.289", "")], ["inertia_kg_m2", "needs mass_kg"]),
        ([("inertia_kg_m2 =", "specific_inertia_m2 = [1,1,1,0,0,0]\ninertia_kg_m2 =")],
         ["not both"]),
        ([("arm_m = 0.138", "coulomb_N_m = 0.138")], ["shape.coulomb_N_m"]),
        ([("viscous_N_m_s", "viscous_Nms")], ["drive.viscous_Nms", "unknown key"]),
        ([('"drum_m"', '"drum_m/0"')], ["drive.drum_radius_m", "has no value"]),
        ([("motor_inertia_kg_m2 = 3.88e-5\n", "")], ["motor_inertia_kg_m2: missing"]),
    ],
)  # fmt: skip
def test_a_wrong_file_says_what_and_where(tmp_path, changes, words):
    text = complaint(tmp_path, *changes)
    missing = [word for word in words if word not in text]
    assert not missing, f"{missing} not in {text}"


def test_five_driven_cables_are_refused(tmp_path):
    text = INCA.read_text()
    (tmp_path / "robot.toml").write_text(text[: text.index('[[cables]]\nname = "6"')])
    with pytest.raises(InputError, match=r"5 driven cables.*n >= 6"):
        read_robot(tmp_path / "robot.toml")
