"""From a robot and goals to one finished controller."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.servo.design.controller import Controller
from freeswing.servo.design.family import design
from freeswing.servo.design.plant import Plant, plant_at
from freeswing.servo.design.tuning import Noise
from freeswing.servo.files.task_file import ANGLE_STD_RAD, POSITION_STD_M, USUAL_CAMERA
from freeswing.servo.files.weights_file import Goals
from freeswing.servo.robot_now import Survey
from freeswing.servo.synthesis.state_space import Array


@dataclass(frozen=True, slots=True)
class Order:
    """What is to be designed.

    Attributes:
        goals: weights, and the camera where its delay is to be designed in.
        at: [x y z roll pitch yaw] to design about.
        states: of the reduced H-infinity controller; None keeps all.
        noise_std: of the poses: position, angle.
        by_encoders: the loop carries poses on to now by the encoders: they are noisy, not late.
    """

    goals: Goals
    at: tuple[float, ...] = (0.0,) * 6
    states: int | None = None
    noise_std: tuple[float, float] = (POSITION_STD_M, ANGLE_STD_RAD)
    by_encoders: bool = False

    @property
    def delay_s(self) -> float:
        """How old poses are on average; the paper's camera where none is given."""
        return 0.0 if self.by_encoders else (self.goals.camera or USUAL_CAMERA).delay_s

    def plant(self, model: DrivenModel, theta: Array | None = None) -> Plant:
        """The robot about the pose, with the poses' delay."""
        return plant_at(model, np.array(self.at), self.delay_s, theta)


def offer(model: DrivenModel, method: str, order: Order) -> Controller:
    """Design one controller.

    Raises:
        ValueError: as `family.design`.
    """
    survey = Survey(model)
    gear = -survey.here(np.array(order.at)).wrench_matrix.T / survey.motors.torque_N_m_A[:, None]
    camera = order.goals.camera or USUAL_CAMERA
    noise = Noise(np.repeat(order.noise_std, 3), camera.period_s)
    found = design(
        method,
        order.plant(model),
        order.goals.weights,
        noise,
        gear,
        with_delay=order.goals.camera is not None and not order.by_encoders,
        order=order.states,
    )
    return replace(found, carried=order.by_encoders and method != "joint-pid")
