"""The driven platform's equations, stated once (INCA 2016, eqs. 3, 8-12), for any n >= 6 cables.

Twist = [v of P in the base frame; omega in the platform frame]: the body's inertia is then constant
and no angles turn singular. A cable lengthens by row . twist; its motor turns by minus that over
the drum's radius. Every tension is affine in the acceleration, so that tensions never need a
second pass.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from freeswing.cdpr.driven.parameters import MotorTerms, Terms
from freeswing.cdpr.model.body import symmetric
from freeswing.cdpr.model.ldl_factors import Factors
from freeswing.cdpr.model.pulley import CableState, cable_state

Expression = Any


def rotation_of(quaternion: Expression) -> Expression:
    """R of a unit quaternion w x y z."""
    w, x, y, z = (quaternion[i] for i in range(4))
    return ca.vertcat(
        ca.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        ca.horzcat(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        ca.horzcat(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def quaternion_rate(quaternion: Expression, omega: Expression) -> Expression:
    """Time derivative of a quaternion under a platform-frame angular velocity."""
    w, vector = quaternion[0], quaternion[1:]
    return ca.vertcat(-ca.dot(vector, omega), w * omega + ca.cross(vector, omega)) / 2


@dataclass(frozen=True, slots=True)
class Body:
    """The rigid body about P, and what weighs on it.

    Attributes:
        mass: M_e.
        moment: mass times the centre's place, platform frame, (3,).
        tensor: inertia about P, platform frame, (3, 3).
    """

    mass: Expression
    moment: Expression
    tensor: Expression

    @classmethod
    def of(cls, values: Expression) -> Body:
        """From `BODY_NAMES` values."""
        return cls(values[0], values[0] * values[1:4], symmetric(values[4:]))

    def with_point(self, mass: Expression, place: Expression) -> Body:
        """With a point mass fixed to it."""
        cross = ca.skew(place)
        return Body(
            self.mass + mass, self.moment + mass * place, self.tensor - mass * cross @ cross
        )

    def matrix(self, turn: Expression) -> Expression:
        """Mass matrix of the twist, (6, 6)."""
        coupling = -turn @ ca.skew(self.moment)
        top = ca.horzcat(self.mass * ca.SX.eye(3), coupling)
        return ca.vertcat(top, ca.horzcat(coupling.T, self.tensor))

    def gyration(self, turn: Expression, omega: Expression) -> Expression:
        """Wrench that the spin alone asks for, (6,)."""
        inward = ca.cross(omega, ca.cross(omega, self.moment))
        return ca.vertcat(turn @ inward, ca.cross(omega, self.tensor @ omega))

    def weight(self, turn: Expression, gravity: Expression) -> Expression:
        """Gravity's wrench about P, (6,)."""
        return ca.vertcat(self.mass * gravity, ca.cross(self.moment, turn.T @ gravity))


@dataclass(frozen=True, slots=True)
class Line:
    """One cable in motion.

    Attributes:
        state: lengths and directions.
        row: lengthening of a unit twist, (6,): [t; A x R't].
        rate: dL/dt.
        drift: L's second derivative at zero acceleration.
    """

    state: CableState
    row: Expression
    rate: Expression
    drift: Expression


def line(
    declared: Terms, index: int, position: Expression, turn: Expression, twist: Expression
) -> Line:
    """Cable `index` at a pose and twist (eq. 3)."""
    state, omega = cable_state(declared.geometry, index, position, turn), turn @ twist[3:]
    arm, along = state.lever, state.direction
    row = ca.vertcat(along, turn.T @ ca.cross(arm, along))
    velocity = twist[:3] + ca.cross(omega, arm)
    inward = ca.dot(omega, arm) * ca.dot(omega, along) - ca.dot(omega, omega) * ca.dot(arm, along)
    return Line(state, row, ca.dot(along, velocity), inward + state.turning(velocity))


@dataclass(frozen=True, slots=True)
class Pull:
    """Tensions as an affine function of the acceleration: loose + reflected * row . acceleration.

    Attributes:
        signs: smoothed sign of each motor's unwinding, (n,).
        loose: tension at zero acceleration, (n,).
        reflected: mass of the motor on its cable, j / r^2, (n,).
    """

    signs: Expression
    loose: Expression
    reflected: Expression


def pull(motors: MotorTerms, lines: tuple[Line, ...], currents: Expression) -> Pull:
    """Tensions at the platform (eq. 9 with theta = (L0 - L) / r_pm, T_a0 = K L0 / r_pm^2).

    T = K L / r^2 + (k I + j L'' / r + f_v L' / r + f_c sign(L' / r)) / r, and at the platform's
    side of the output pulley its friction `roll` on top.
    """
    lengths = ca.vertcat(*[one.state.length for one in lines])
    radius = motors.drum_radius
    unwinding = ca.vertcat(*[one.rate for one in lines]) / radius
    drift = ca.vertcat(*[one.drift for one in lines])
    sign = ca.tanh(unwinding / motors.coulomb_width)
    torque = (
        motors.spring * lengths / radius
        + motors.torque_constant * currents
        + motors.inertia * drift / radius
        + motors.viscous * unwinding
        + motors.coulomb * sign
    )
    gain = 1 + motors.roll * sign
    return Pull(sign, gain * torque / radius, gain * motors.inertia / radius**2)


@dataclass(frozen=True, slots=True)
class Balance:
    """matrix @ acceleration = effort: eq. (10) in twist coordinates.

    Attributes:
        matrix: symmetric positive definite, also where output pulleys rub, (6, 6); only its
            lower triangle is filled.
        effort: (6,).
    """

    matrix: Expression
    effort: Expression

    @property
    def whole(self) -> Expression:
        """The matrix with both triangles, (6, 6)."""
        return ca.tril2symm(ca.tril(self.matrix))

    def solved(self, right: Expression) -> Expression:
        """matrix^-1 @ right, (6, k)."""
        factors = Factors.of(self.matrix)
        return ca.horzcat(*[factors.solved(right[:, k]) for k in range(right.shape[1])])


def balance(
    body: Body,
    lines: tuple[Line, ...],
    pulled: Pull,
    turn: Expression,
    twist: Expression,
    outer: Expression,
) -> Balance:
    """Newton and Euler with motors reflected on the cables.

    Args:
        body: what moves.
        lines: the cables.
        pulled: their tensions.
        turn: R.
        twist: (6,).
        outer: weight and all other wrenches, force in the base frame, moment about P in the
            platform frame, (6,).
    """
    matrix, effort = body.matrix(turn), outer - body.gyration(turn, twist[3:])
    for index, one in enumerate(lines):
        scaled = pulled.reflected[index] * one.row
        for i in range(6):
            for j in range(i + 1):  # the lower triangle is all that is read
                matrix[i, j] += scaled[i] * one.row[j]
        effort -= pulled.loose[index] * one.row
    return Balance(matrix, effort)
