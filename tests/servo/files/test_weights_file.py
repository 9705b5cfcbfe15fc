"""weights.toml and task.toml: what is read and what is refused."""

import numpy as np
import pytest

from freeswing.cdpr.files.problems import InputError
from freeswing.servo.files.task_file import USUAL_CAMERA, read_task
from freeswing.servo.files.weights_file import USUAL, read_weights

PART = """w1 = 0.5
w2 = {{ gain = {gain}, zero_rad_s = 0.01, pole_rad_s = 1e4, order = 2 }}
w3 = {{ gain = {w3}, zero_rad_s = 10.0, pole_rad_s = 1e-4 }}
"""
GOOD = (
    'format = "freeswing-weights/1"\n[position]\n'
    + PART.format(gain=40.0, w3=10.0)
    + "[orientation]\n"
    + PART.format(gain=100.0, w3=1.0)
)
TASK = """format = "freeswing-task/1"
[[steps]]
t_s = 0.0
position_m = [0.0, 0.0, 0.0]
[[steps]]
t_s = 2.0
position_m = [0.1, -0.1, 0.0]
angles_rad = [0.0, 0.0, 0.1]
"""


def written(folder, text):
    path = folder / "file.toml"
    path.write_text(text)
    return path


def test_the_corrected_weights_are_read(tmp_path):
    goals = read_weights(written(tmp_path, GOOD))
    assert goals.weights == USUAL
    assert goals.camera is None
    late = GOOD + "[camera]\nperiod_s = 0.005\nlatency_s = 0.0107\n"
    assert read_weights(written(tmp_path, late)).camera.delay_s == pytest.approx(0.0132)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("pole_rad_s = 1e-4", "pole_rad_s = 0.0", "on the imaginary axis"),
        ("pole_rad_s = 1e-4", "pole_rad_s = -1.0", "unstable"),
        (", pole_rad_s = 1e-4", "", "improper"),
        ("w1 = 0.5", "w1 = [0.5, 0.5]", "one filter serves all three axes"),
        ("w1 = 0.5", "w1 = 0.0", "must be > 0"),
        ("order = 2", "order = 9", "must be <= 4"),
        ("w1 = 0.5", "w1 = 0.5\nw4 = 1.0", "unknown key"),
        ("[orientation]", "[rotation]", "orientation: missing"),
    ],
)
def test_wrong_weights_are_refused_by_key(tmp_path, old, new, says):
    assert old in GOOD
    with pytest.raises(InputError, match=says):
        read_weights(written(tmp_path, GOOD.replace(old, new)))


def test_a_task_is_read_and_sampled(tmp_path):
    task = read_task(written(tmp_path, TASK))
    assert task.end_s == 4.0
    assert task.watch.camera == USUAL_CAMERA
    np.testing.assert_array_equal(task.at(np.array([0.0, 1.999, 2.0]))[:, 0], [0.0, 0.0, 0.1])
    assert task.poses[1, 5] == 0.1


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("t_s = 2.0", "t_s = 0.0", "must increase"),
        ("t_s = 0.0", "t_s = 0.5", "begins at 0"),
        ("[0.1, -0.1, 0.0]", "[150.0, -0.1, 0.0]", "millimetres"),
        ("[0.0, 0.0, 0.1]", "[0.0, 0.0, 45.0]", "degrees"),
        ("[0.0, 0.0, 0.1]", "[0.0, 1.57, 0.1]", "pitch"),
        ("t_s = 2.0", "t_s = 2.0\nspeed = 1.0", "unknown key"),
        ("[[steps]]\nt_s = 0.0", "end_s = 1.0\n[[steps]]\nt_s = 0.0", "not after the last step"),
    ],
)
def test_wrong_tasks_are_refused_by_key(tmp_path, old, new, says):
    assert old in TASK
    with pytest.raises(InputError, match=says):
        read_task(written(tmp_path, TASK.replace(old, new)))
