"""What control decides, on both sides of every limit, on made numbers."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.files.problems import InputError
from freeswing.servo.design import hinf, tuning
from freeswing.servo.files.identified_file import identified
from freeswing.servo.files.task_file import Task, Watch, read_task
from freeswing.servo.loop import closed_loop
from freeswing.servo.loop.closed_loop import Run
from freeswing.servo.loop.judge import judge
from freeswing.servo.synthesis.state_space import StateSpace

RATE_HZ = 1000


def run_of(poses: np.ndarray) -> Run:
    n = len(poses)
    zero, one = np.zeros((n, 6)), np.ones((n, 2))
    return Run(np.arange(n) / RATE_HZ, zero, poses, zero, one, one, 5.0 * one, np.ones(n), None)


def judged(poses: np.ndarray):
    """A run of three seconds that is asked to stay at zero."""
    task = Task(np.zeros(1), np.zeros((1, 6)), len(poses) / RATE_HZ, None)
    return judge(run_of(poses), task, ("a", "b"), np.array([[1.0, 10.0]] * 2))


def off(place: int, size: float) -> np.ndarray:
    poses = np.zeros((3000, 6))
    poses[:, place] = size
    return poses


@pytest.mark.parametrize(
    ("place", "size", "held"),
    [(0, 0.048, True), (0, 0.052, False), (5, 0.34, True), (5, 0.36, False)],
)
def test_a_platform_is_held_within_50_mm_and_20_degrees(place, size, held):
    assert judged(off(place, size)).held == held


@pytest.mark.parametrize(("size", "held"), [(0.048, True), (0.052, False)])
def test_a_platform_that_shakes_by_50_mm_is_not_held(size, held):
    assert judged(off(0, size) * np.tile([1.0, -1.0], 1500)[:, None]).held == held


def test_what_is_left_is_read_over_the_last_second():
    poses = np.full((3000, 6), 0.01) * (np.arange(6) == 0)
    poses[2000:2100, 0] = 0.03
    assert judged(poses).steps[0].left_m == pytest.approx(0.012)
    poses[:2000, 0] = 0.04
    assert judged(poses).steps[0].left_m == pytest.approx(0.012)


@pytest.mark.parametrize(("far", "lost"), [(0.98, None), (1.02, 0.0)])
def test_a_platform_is_lost_a_metre_from_where_it_is_asked_to_be(monkeypatch, far, lost):
    class Body:
        def __init__(self, *_):
            self.state = np.zeros(13)

        def angles(self):
            return np.zeros(2)

    class Brain:
        def __init__(self, *_):
            pass

        def decide(self, *_):
            raise StopIteration  # it is not lost: the loop goes on

    task = SimpleNamespace(end_s=0.002, at=lambda times: np.full((len(times), 6), far))
    loop = SimpleNamespace(task=task, model=SimpleNamespace(n_cables=2))
    monkeypatch.setattr(closed_loop, "_Body", Body)
    monkeypatch.setattr(closed_loop, "_Brain", Brain)
    monkeypatch.setattr(closed_loop, "pose6", lambda _: np.zeros(6))
    if lost is None:
        with pytest.raises(StopIteration):
            closed_loop.run_loop(loop)
        return
    assert closed_loop.run_loop(loop).lost_s == lost


@pytest.mark.parametrize(("norm", "said"), [(1.019, 1), (1.021, 0)])
def test_weights_ask_for_nothing_where_no_controller_comes_within_two_per_cent(
    monkeypatch, norm, said
):
    """Of the least gamma, here one."""
    matrix = -np.eye(2)
    plant = StateSpace(matrix, np.eye(2), np.eye(2), np.zeros((2, 2)))
    problem = SimpleNamespace(n_measured=1, n_controls=1, plant=plant)
    weights = SimpleNamespace(position=None, orientation=None)
    monkeypatch.setattr(hinf, "hinf_norm", lambda _: SimpleNamespace(value=norm))
    monkeypatch.setattr(hinf, "_template", lambda _: 1.0)
    assert len(hinf._idle(problem, weights, 1.0)) == said


@pytest.mark.parametrize(("margin", "index"), [(0.46, 1), (0.44, 0)])
def test_a_modulus_margin_of_045_is_kept(monkeypatch, margin, index):
    """The faster of two speeds has the margin; the slower one keeps all."""

    def look(_plant, _response, speeds, *_):
        fast = speeds[0] > 1.5
        return tuning.Look(True, (margin if fast else 0.9, 0.9), (0.0, 0.0))

    monkeypatch.setattr(tuning, "look", look)
    plant = SimpleNamespace(system=SimpleNamespace(at=lambda _: None))
    grid = np.array([1.0, 2.0])
    found = tuning.fastest(lambda speeds: speeds, plant, 0.0, None, tied=True, grid=grid)
    assert found[0] == grid[index]


@pytest.mark.parametrize(("least", "refused"), [(-0.9e-8, False), (-1.1e-8, True)])
def test_correlations_are_negative_by_rounding_alone(least, refused):
    numbers = [SimpleNamespace(name=name, value=1.0, std=0.1, tied=()) for name in ("a", "b")]
    joint = numbers, np.array([[1.0, 1.0 - least], [1.0 - least, 1.0]])
    model = SimpleNamespace(names=("a", "b"), robot=SimpleNamespace(name="r"))
    if refused:
        with pytest.raises(ValueError, match="make no covariance"):
            identified(*joint, model)
        return
    assert identified(*joint, model).values.tolist() == [1.0, 1.0]


def task_text(end_s: str, position: float) -> str:
    return (
        f'format = "freeswing-task/1"\n{end_s}\n[[steps]]\nt_s = 0.0\n'
        f"position_m = [{position}, 0, 0]\n"
    )


@pytest.mark.parametrize(
    ("end_s", "position", "words"),
    [
        ("end_s = 590", 98.0, ""),
        ("end_s = 610", 0.0, "end_s"),
        ("", 102.0, "is this in millimetres?"),
    ],
)
def test_tasks_of_ten_minutes_and_a_hundred_metres(tmp_path, end_s, position, words):
    path = tmp_path / "task.toml"
    path.write_text(task_text(end_s, position))
    if words:
        with pytest.raises(InputError, match=words.replace("?", r"\?")):
            read_task(path)
        return
    assert read_task(path).end_s == 590.0


def test_a_task_of_one_step_holds_it_for_two_seconds(tmp_path):
    path = tmp_path / "task.toml"
    path.write_text(task_text("", 0.0))
    assert read_task(path).end_s == 2.0


def test_the_papers_camera_sees_to_1_7_millimetres_and_5_milliradians():
    assert Watch().position_std_m == pytest.approx(0.0017)
    assert Watch().angle_std_rad == pytest.approx(0.005)
