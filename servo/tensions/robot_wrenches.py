"""Wrenches on the platform of one robot as currents between its limits."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.driven.statics import holding_wrench
from freeswing.cdpr.rotation import matrix_from_quaternion
from freeswing.servo.robot_now import Survey, pose7
from freeswing.servo.synthesis.state_space import Array
from freeswing.servo.tensions.methods import Demands, Shares, distribute_all

OBJECTIVE_N = 10.0  # T_obj of the paper's section 5.3


def demands_at_rest(
    model: DrivenModel,
    poses: Array,
    wrenches: Array,
    *,
    objective_N: float = OBJECTIVE_N,
    of_motors: bool = False,
) -> tuple[Demands, Array, Array]:
    """What `distribute_all` takes, for a robot at rest.

    Eq. (9) at rest: T = K L / r^2 + k I / r, between the limits of tensions and currents both.

    Args:
        model: the driven robot.
        poses: position and quaternion, (k, 7).
        wrenches: force and moment about P, base axes, (k, 6): of the cables, W T.
        objective_N: tension that all cables should be near.
        of_motors: the wrenches are those of the motors alone, W_I I of (13), springs not counted.

    Returns:
        The demands, the springs' tensions (k, n) and tension per current (n,).

    Source:
        INCA 2016, eqs. (9), (11), (13).
    """
    survey = Survey(model)
    motors = survey.motors
    found = [survey.at(pose) for pose in poses]
    A = np.array([at.wrench_matrix for at in found])
    springs = np.array([at.springs_N for at in found])
    per_A = motors.tension_per_A
    ends = motors.current_limits_A, (motors.tension_limits_N[None] - springs[:, :, None])
    lower = np.maximum(ends[0][:, 0], ends[1][:, :, 0] / per_A)
    upper = np.minimum(ends[0][:, 1], ends[1][:, :, 1] / per_A)
    wish = (objective_N - springs) / per_A
    offset = np.zeros((len(poses), 6))
    if not of_motors:
        offset = np.einsum("kij,kj->ki", A / per_A, springs)
    return Demands(A, wrenches, offset, lower, upper, wish), springs, per_A


def held_at_rest(model: DrivenModel, poses: Array) -> Shares:
    """Whether tensions between their limits hold the platform at rest.

    Args:
        model: the driven robot.
        poses: [x y z roll pitch yaw], (k, 6).
    """
    places = np.array([pose7(pose) for pose in poses])
    wrenches = np.array([holding_wrench(model, place) for place in places])
    turns = matrix_from_quaternion(places[:, 3:])
    wrenches[:, 3:] = np.einsum("kij,kj->ki", turns, wrenches[:, 3:])
    return distribute_all(demands_at_rest(model, places, wrenches, of_motors=True)[0])
