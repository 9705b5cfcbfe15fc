"""Rigid-body kinematics of the platform as symbolic expressions, written once.

Pose coordinates are zeta = [p; epsilon] with epsilon = (phi, theta, chi) and
R = Rx(phi) Ry(theta) Rz(chi) (FIDIM 2022, sec. 2; self-calibration 2019, sec. 2.1).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

Expression = Any  # casadi SX, MX or DM: casadi ships no types


def rotation(angles: Expression) -> Expression:
    """R(epsilon) as a 3 x 3 expression of the three Tait-Bryan angles."""
    sin, cos = [ca.sin(angles[i]) for i in range(3)], [ca.cos(angles[i]) for i in range(3)]
    about_x = ca.vertcat(
        ca.horzcat(1, 0, 0), ca.horzcat(0, cos[0], -sin[0]), ca.horzcat(0, sin[0], cos[0])
    )
    about_y = ca.vertcat(
        ca.horzcat(cos[1], 0, sin[1]), ca.horzcat(0, 1, 0), ca.horzcat(-sin[1], 0, cos[1])
    )
    about_z = ca.vertcat(
        ca.horzcat(cos[2], -sin[2], 0), ca.horzcat(sin[2], cos[2], 0), ca.horzcat(0, 0, 1)
    )
    return about_x @ about_y @ about_z


def rate_matrix(angles: Expression) -> Expression:
    """H(epsilon) with omega = H epsilon_dot in the base frame (self-calibration 2019, eq. 24)."""
    sin, cos = [ca.sin(angles[i]) for i in range(2)], [ca.cos(angles[i]) for i in range(2)]
    return ca.vertcat(
        ca.horzcat(1, 0, sin[1]),
        ca.horzcat(0, cos[0], -sin[0] * cos[1]),
        ca.horzcat(0, sin[0], cos[0] * cos[1]),
    )


def small_rotation(vector: Expression) -> Expression:
    """Rodrigues' rotation matrix of a rotation vector, smooth at zero (unlike the axis form)."""
    square = ca.dot(vector, vector) + 1e-30
    angle = ca.sqrt(square)
    cross = ca.skew(vector)
    return (
        ca.SX.eye(3) + ca.sin(angle) / angle * cross + (1 - ca.cos(angle)) / square * cross @ cross
    )


def symmetric(entries: Expression) -> Expression:
    """The symmetric 3 x 3 matrix of xx yy zz xy xz yz (FIDIM 2022, eqs. 15, 16)."""
    xx, yy, zz, xy, xz, yz = (entries[i] for i in range(6))
    return ca.vertcat(ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz))


def along(expression: Expression, variables: Expression, rates: Expression) -> Expression:
    """Directional derivative of an expression when `variables` move with `rates`."""
    return ca.jtimes(expression, variables, rates)


@dataclass(frozen=True, slots=True)
class Spin:
    """Rotation of the platform in its own frame.

    Attributes:
        angles: phi, theta, chi, (3,).
        matrix: body angular velocity = matrix @ angle rates, (3, 3).
        omega: body angular velocity, (3,).
        drift: its time derivative at zero second angle rates, (3,).
    """

    angles: Expression
    matrix: Expression
    omega: Expression
    drift: Expression

    @classmethod
    def of(cls, angles: Expression, rates: Expression) -> Spin:
        """The spin of angles and their rates."""
        sin, cos = (ca.sin(angles), ca.cos(angles))
        matrix = ca.vertcat(
            ca.horzcat(cos[2] * cos[1], sin[2], 0),
            ca.horzcat(-sin[2] * cos[1], cos[2], 0),
            ca.horzcat(sin[1], 0, 1),
        )
        omega = matrix @ rates
        return cls(angles, matrix, omega, along(omega, angles, rates))

    def angle_rates(self, vector: Expression) -> Expression:
        """Inverse of `matrix` times a vector, in closed form; singular at theta = 90 degrees."""
        sin, cos = ca.sin(self.angles), ca.cos(self.angles)
        phi = (cos[2] * vector[0] - sin[2] * vector[1]) / cos[1]
        theta = sin[2] * vector[0] + cos[2] * vector[1]
        return ca.vertcat(phi, theta, vector[2] - sin[1] * phi)

    def torque(self, effort: Expression) -> Expression:
        """Body torque of efforts conjugate to the angle rates: transposed inverse of `matrix`."""
        sin, cos = ca.sin(self.angles), ca.cos(self.angles)
        across = (effort[0] - sin[1] * effort[2]) / cos[1]
        x = cos[2] * across + sin[2] * effort[1]
        return ca.vertcat(x, cos[2] * effort[1] - sin[2] * across, effort[2])
