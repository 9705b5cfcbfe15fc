"""The same closed loop around MuJoCo's robot."""

import mujoco
import numpy as np

from freeswing.servo.design.offer import Order, offer
from freeswing.servo.driven_file import read_driven
from freeswing.servo.files.task_file import Task, Watch
from freeswing.servo.files.weights_file import USUAL, Camera, Goals
from freeswing.servo.loop import closed_loop
from freeswing.servo.loop.anti_windup import LinearRegulator
from freeswing.servo.loop.closed_loop import Loop, run_loop
from freeswing.servo.loop.trials import without_coulomb
from freeswing.servo.robot_now import pose7
from tests.oracle.witnesses import mujoco_driven
from tests.places import SAMPLES


class MujocoBody:
    """Stands in for the product's own robot: same state, currents, angles, another engine."""

    def __init__(self, loop, start):
        robot = loop.model.robot
        n = robot.n_cables
        body = mujoco_driven.DrivenBody(
            0.289, np.zeros(3), np.diag([1.49e-4, 2.07e-4, 2.07e-4]), np.full(n, 14.4),
            np.full(n, 0.006), np.full(n, 0.0175), np.full(n, 3.88e-5), np.full(n, 6.68e-5),
            np.full(n, 0.0603), 0.0013,
        )  # fmt: skip
        self._body = body
        self._model = mujoco.MjModel.from_xml_string(mujoco_driven._xml(robot, body, pose7(start)))  # pyright: ignore[reportAttributeAccessIssue]
        self._data = mujoco.MjData(self._model)  # pyright: ignore[reportAttributeAccessIssue]
        mujoco.mj_forward(self._model, self._data)  # pyright: ignore[reportAttributeAccessIssue]
        self._data.act[:] = OwnBody(loop, start).currents
        self._zero = self._data.ten_length.copy()

    @property
    def state(self):
        # MuJoCo's free joint: linear velocity in the world, angular in the body, as here.
        return np.concatenate([self._data.qpos, self._data.qvel])

    def angles(self):
        mujoco.mj_fwdPosition(self._model, self._data)  # pyright: ignore[reportAttributeAccessIssue]
        return (self._zero - self._data.ten_length) / self._body.drum_m

    @property
    def currents(self):
        return self._data.act.copy()

    def move(self, references):
        self._data.ctrl[:] = references
        for _ in range(round(1e-3 / mujoco_driven.TIME_STEP_S)):
            mujoco.mj_step(self._model, self._data)  # pyright: ignore[reportAttributeAccessIssue]


OwnBody = closed_loop._Body


def test_the_closed_loop_around_mujocos_robot_gives_the_same_pose(monkeypatch):
    _, model = read_driven(SAMPLES / "inca-6d")
    found = offer(model, "hinf", Order(Goals(USUAL, Camera(0.005, 0.0107))))
    poses = np.zeros((3, 6))
    poses[1], poses[2] = [0.1, 0.1, 0, 0, 0, 0], [-0.1, 0.1, 0, 0, 0, 0.1]
    watch = Watch(Camera(0.005, 0.0107), 0.0, 0.0, 0.0)
    task = Task(np.array([0.0, 0.05, 0.6]), poses, 1.2, watch)
    runs = []
    for body in (OwnBody, MujocoBody):
        monkeypatch.setattr(closed_loop, "_Body", body)
        loop = Loop(
            model, without_coulomb(model), LinearRegulator(found.sampled), found.wrench, task
        )
        runs.append(run_loop(loop).poses)
    gap = np.abs(runs[0] - runs[1])
    assert np.abs(runs[0][:, 0]).max() > 0.1
    assert gap[:, :3].max() < 1e-4, f"{1e3 * gap[:, :3].max():.4f} mm"
    assert gap[:, 3:].max() < 1e-3, f"{1e3 * gap[:, 3:].max():.4f} mrad"
