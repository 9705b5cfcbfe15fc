"""The linear model about a pose (INCA 2016, eqs. 14-17) by exact derivatives, and its modes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel, function
from freeswing.cdpr.driven.scene import Premises, scene
from freeswing.cdpr.model.batch import evaluate

Array = NDArray[np.float64]
Function = Any
Expression = Any

COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")


def rpy_rotation(angles: Expression) -> Expression:
    """R = Rz(yaw) Ry(pitch) Rx(roll) of (1), an expression of [roll; pitch; yaw]."""
    (sr, sp, sy), (cr, cp, cy) = ([f(angles[i]) for i in range(3)] for f in (ca.sin, ca.cos))
    return ca.vertcat(
        ca.horzcat(cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        ca.horzcat(sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        ca.horzcat(-sp, cp * sr, cp * cr),
    )


def rpy_rates(angles: Expression) -> Expression:
    """J_rpy of (5): angular velocity in the base frame = J_rpy @ angle rates."""
    (sp, sy), (cp, cy) = ([f(angles[i]) for i in (1, 2)] for f in (ca.sin, ca.cos))
    return ca.vertcat(
        ca.horzcat(cy * cp, -sy, 0), ca.horzcat(sy * cp, cy, 0), ca.horzcat(-sp, 0, 1)
    )


@dataclass(frozen=True, slots=True)
class LinearModel:
    """x' = A x + B u, y = C x + D u with x = [dX; dX'], X = [x y z roll pitch yaw] of (1).

    u is the change of the wrench F_ev: force and moment about P, base axes. Coulomb friction is
    left out.

    Attributes:
        at: X of the operating point, (6,).
        wrench: F_ev that holds it, (6,).
        mass: M_o, (6, 6).
        damping: C_o of (16), (6, 6).
        stiffness: K_o of (16), (6, 6).
        turning: derivative of A_v^T F_ev by X with F_ev held, (6, 6): what (14) leaves out, zero
            where the cables' moment is zero.
        velocity_map: A_v, (6, 6).
        wrench_matrix: W_I, base axes, (6, n): u = W_I dI.
    """

    at: Array
    wrench: Array
    mass: Array
    damping: Array
    stiffness: Array
    turning: Array
    velocity_map: Array
    wrench_matrix: Array

    @property
    def A(self) -> Array:
        """State matrix, (12, 12)."""
        low = -np.linalg.solve(self.mass, np.hstack([self.stiffness - self.turning, self.damping]))
        whole = np.vstack([np.hstack([np.zeros((6, 6)), np.eye(6)]), low])
        return np.asarray(whole, dtype=np.float64)

    @property
    def B(self) -> Array:
        """Input matrix, (12, 6)."""
        low = np.linalg.solve(self.mass, self.velocity_map.T)
        return np.asarray(np.vstack([np.zeros((6, 6)), low]), dtype=np.float64)

    @property
    def C(self) -> Array:
        """Output matrix, (6, 12)."""
        return np.hstack([np.eye(6), np.zeros((6, 6))])

    @property
    def D(self) -> Array:
        """Feedthrough, zero, (6, 6)."""
        return np.zeros((6, 6))

    def response(self, rates_rad_s: Array) -> NDArray[np.complex128]:
        """C (j w - A)^-1 B, (n, 6, 6) complex."""
        resolvent = 1j * np.asarray(rates_rad_s)[:, None, None] * np.eye(12) - self.A
        return self.C @ np.linalg.solve(
            resolvent, np.broadcast_to(self.B, (*resolvent.shape[:1], 12, 6))
        )


def linear_model(model: DrivenModel, at: Array, theta: Array | None = None) -> LinearModel:
    """The linear model about X = [x y z roll pitch yaw], held there by the wrench that it takes.

    Args:
        model: the equations.
        at: X, (6,).
        theta: the model's numbers; None as declared.

    Raises:
        ValueError: for a pitch of 90 degrees, where these angles are singular.
    """
    theta = model.declared if theta is None else theta
    at = np.asarray(at, dtype=np.float64)
    if abs(np.cos(at[4])) < 1e-6:
        raise ValueError(f"pitch {at[4]:.4f} rad: roll and yaw cannot be told apart there")
    found = evaluate(_linearised(model), at, np.zeros(6), np.zeros(6), theta)
    wrench = np.linalg.solve(found[5].T, found[0])
    turning = evaluate(_turning(), at, wrench)[0]
    return LinearModel(at, wrench, found[1], found[2], found[3], turning, found[5], found[4])


@lru_cache(maxsize=16)
def _linearised(model: DrivenModel) -> Function:
    """(X, X', X'', theta) -> generalised force, M_o, C_o, K_o, W_I in base axes, A_v."""
    given = _smooth(model.premises)
    x, rates, second = (ca.SX.sym(name, 6) for name in ("x", "rates", "second"))
    turn, spin = rpy_rotation(x[3:]), rpy_rates(x[3:])
    to_twist = ca.diagcat(ca.SX.eye(3), turn.T @ spin)
    twist = to_twist @ rates
    along = ca.jtimes(twist, x, rates)
    now = scene(given, x[:3], turn, twist, ca.SX.zeros(model.n_cables))
    force = now.balanced.whole @ (to_twist @ second + along) - now.balanced.effort
    general = to_twist.T @ force
    motors = given.terms.motors
    gains = -now.rows.T @ ca.diag(motors.torque_constant / motors.drum_radius)
    outputs = {
        "general": general,
        "matrix_mass": ca.jacobian(general, second),
        "matrix_damping": ca.jacobian(general, rates),
        "matrix_stiffness": ca.jacobian(general, x),
        "matrix_wrench": ca.diagcat(ca.SX.eye(3), turn) @ gains,
        "matrix_velocity": ca.diagcat(ca.SX.eye(3), spin),
    }
    inputs = {"x": x, "rates": rates, "second": second, "theta": given.theta}
    return function("linearised", inputs, outputs)


@lru_cache(maxsize=1)
def _turning() -> Function:
    x, wrench = ca.SX.sym("x", 6), ca.SX.sym("wrench", 6)
    general = ca.diagcat(ca.SX.eye(3), rpy_rates(x[3:])).T @ wrench
    outputs = {"matrix_turning": ca.jacobian(general, x)}
    return function("turning", {"x": x, "wrench": wrench}, outputs)


def _smooth(given: Premises) -> Premises:
    """Without Coulomb friction and output pulleys: they have no derivative at rest."""
    n = given.robot.n_cables
    motors = replace(given.terms.motors, coulomb=ca.SX.zeros(n), roll=ca.SX.zeros(n))
    return replace(given, terms=replace(given.terms, motors=motors))


@dataclass(frozen=True, slots=True)
class Mode:
    """One mode of the linear model.

    Attributes:
        rate_rad_s: undamped frequency; for a mode that does not swing, its decay.
        damping: ratio to critical.
        words: how the platform moves, such as "mostly x".
        shape: amplitude of X, the largest of each kind's share 1, (6,).
    """

    rate_rad_s: float
    damping: float
    words: str
    shape: Array


def modes(linear: LinearModel) -> tuple[Mode, ...]:
    """The modes by rising frequency; a conjugate pair is one."""
    values, vectors = np.linalg.eig(linear.A)
    found = []
    for value, vector in zip(values, vectors.T, strict=True):
        if value.imag < -1e-9 * abs(value):
            continue
        shape = vector[:6] / vector[np.argmax(np.abs(vector[:6]))]
        rate = abs(value)
        damping = -value.real / rate if rate > 0.0 else 0.0
        found.append(Mode(float(rate), float(damping), _words(linear.mass, shape), shape.real))
    return tuple(sorted(found, key=lambda mode: mode.rate_rad_s))


def _words(mass: Array, shape: Array) -> str:
    """Which coordinates hold the mode's kinetic energy."""
    share = np.abs(shape) ** 2 * np.diag(mass)
    share = share / share.sum()
    order = np.argsort(share)[::-1]
    leading = [int(k) for k in order if share[k] >= 0.1]
    names = " and ".join(COORDINATES[k] for k in leading)
    return f"{'only' if share[order[0]] > 0.99 else 'mostly'} {names}"
