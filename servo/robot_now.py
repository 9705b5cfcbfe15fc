"""What the controller's own model says about a pose: wrench matrix, spring tensions, angles."""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.model.batch import Bound
from freeswing.cdpr.rotation import matrix_from_quaternion
from freeswing.servo.synthesis.state_space import Array


def rotation(angles_rad: Array) -> Array:
    """R = Rz(yaw) Ry(pitch) Rx(roll) of eq. (1)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles_rad), np.sin(angles_rad)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def pose7(pose: Array) -> Array:
    """Position and quaternion of [x y z roll pitch yaw].

    Source:
        INCA 2016, eq. (1); as a quaternion: Diebel 2006, Representing Attitude.
    """
    roll, pitch, yaw = (pose[3:] / 2.0).tolist()
    cr, cp, cy = math.cos(roll), math.cos(pitch), math.cos(yaw)
    sr, sp, sy = math.sin(roll), math.sin(pitch), math.sin(yaw)
    quaternion = [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ]
    return np.concatenate([pose[:3], quaternion])


def pose6(state: Array) -> Array:
    """[x y z roll pitch yaw] of position and quaternion, pitch within 90 degrees.

    Source:
        INCA 2016, eq. (1), solved for its angles: Diebel 2006, Representing Attitude.
    """
    px, py, pz, w, x, y, z = state[:7].tolist()
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(min(max(2 * (w * y - x * z), -1.0), 1.0))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.array([px, py, pz, roll, pitch, yaw])


@dataclass(frozen=True, slots=True)
class Motors:
    """The motors' constants, one number each, (n,), and limits (n, 2)."""

    drum_m: Array
    torque_N_m_A: Array
    spring_N_m: Array
    coulomb_N_m: Array
    current_limits_A: Array
    tension_limits_N: Array

    @property
    def tension_per_A(self) -> Array:
        """k_em / r_pm."""
        return self.torque_N_m_A / self.drum_m


def motors_of(model: DrivenModel, theta: Array | None = None) -> Motors:
    """Read the motors' constants out of a model; springs as felt along their cable, K_eq / r_pm^2.

    Raises:
        ValueError: for a robot without [drive].
    """
    theta = model.declared if theta is None else theta
    drive = model.drive
    terms = model.premises.terms.motors
    columns = ca.horzcat(
        terms.drum_radius,
        terms.torque_constant,
        terms.spring / terms.drum_radius**2,
        terms.coulomb,
    )
    # As in the model, an effect's own parameters stand in theta too.
    numbers = np.array(ca.Function("motors", [model.premises.theta], [columns])(theta))
    drum, torque, spring, coulomb = numbers.T
    limits = drive.current_limits_A, drive.tension_limits_N
    return Motors(drum, torque, spring, coulomb, *limits)


@dataclass(frozen=True, slots=True)
class Here:
    """The robot at one pose.

    Attributes:
        wrench_matrix: W_I, base axes, (6, n).
        lengths_m: (n,).
        springs_N: tension of the balancing springs, (n,).
    """

    wrench_matrix: Array
    lengths_m: Array
    springs_N: Array


class Survey:
    """Gives the robot at one pose after another, its memory bound once.

    Args:
        model: the driven robot.
        theta: its numbers; None as declared.
    """

    def __init__(self, model: DrivenModel, theta: Array | None = None) -> None:
        theta = model.declared if theta is None else theta
        self.motors = motors_of(model, theta)
        self._lengths, self._matrix = Bound(model.lengths, 1), Bound(model.wrench_matrix, 1)
        for bound in (self._lengths, self._matrix):
            bound.inputs[1][:] = theta

    def lengths_m(self, place: Array) -> Array:
        """Cable lengths at position and quaternion, (n,)."""
        self._lengths.inputs[0][0] = place
        self._lengths.run()
        return self._lengths.outputs[0][0].copy()

    def here(self, pose: Array) -> Here:
        """The robot at [x y z roll pitch yaw]."""
        return self.at(pose7(pose))

    def at(self, place: Array) -> Here:
        """The robot at position and quaternion."""
        self._matrix.inputs[0][0] = place
        self._matrix.run()
        matrix = self._matrix.outputs[0][0].T.copy()
        matrix[3:] = matrix_from_quaternion(place[3:]) @ matrix[3:]
        lengths = self.lengths_m(place)
        return Here(matrix, lengths, self.motors.spring_N_m * lengths)
