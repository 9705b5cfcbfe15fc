"""The paper's equations (2)-(12) as it prints them, in roll, pitch, yaw, by scipy's integrator.

Shares nothing with the program: numpy alone, angles instead of quaternions, matrices of the paper.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from tests.oracle.mechanics.world import Array

GRAVITY = 9.80665


@dataclass(frozen=True, slots=True)
class Plant:
    """Table 1, one number for all motors or one a motor; points in metres, (8, 3)."""

    outputs: Array
    arms: Array
    mass: float
    inertia: Array
    drum: Array
    spring: Array
    motor: Array
    viscous: Array
    coulomb: Array
    torque: Array
    lag_s: float
    width: float = 0.1

    def lines(self, x: Array) -> tuple[Array, Array, Array, Array]:
        """Lengths, J~ without the drums (8, 6), R, J_rpy."""
        (sr, sp, sy), (cr, cp, cy) = np.sin(x[3:6]), np.cos(x[3:6])
        turn = np.array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ]
        )
        spin = np.array([[cy * cp, -sy, 0.0], [sy * cp, cy, 0.0], [-sp, 0.0, 1.0]])
        arms = self.arms @ turn.T
        vectors = x[:3] + arms - self.outputs
        lengths = np.sqrt(np.sum(vectors**2, axis=1))
        along = vectors / lengths[:, None]
        return lengths, np.hstack([along, np.cross(arms, along) @ spin]), turn, spin

    def second_rates(self, x: Array, rates: Array, currents: Array) -> Array:
        """X'' of (10)."""
        lengths, j, turn, spin = self.lines(x)
        small = 1e-6
        ahead, behind = (self.lines(x + s * small * rates) for s in (1.0, -1.0))
        j_rate = (ahead[1] - behind[1]) / (2 * small)
        spin_rate = (ahead[3] - behind[3]) / (2 * small)
        j, j_rate = j / self.drum[:, None], j_rate / self.drum[:, None]
        inertia = turn @ np.diag(self.inertia) @ turn.T
        omega = spin @ rates[3:]
        mass = np.zeros((6, 6))
        mass[:3, :3] = self.mass * np.eye(3)
        mass[3:, 3:] = spin.T @ inertia @ spin
        mass += j.T @ (self.motor[:, None] * j)
        unwinding = j @ rates
        effort = self.motor * (j_rate @ rates) + self.viscous * unwinding
        effort = effort + self.coulomb * np.tanh(unwinding / self.width)
        effort = effort + self.spring * 0.006**2 * lengths / self.drum + self.torque * currents
        right = -j.T @ effort
        right[2] -= self.mass * GRAVITY
        gyration = inertia @ (spin_rate @ rates[3:]) + np.cross(omega, inertia @ omega)
        right[3:] -= spin.T @ gyration
        return np.linalg.solve(mass, right)

    def motion(self, x: Array, references: Array, rate_hz: float, start_A: Array) -> Array:
        """X at every sample under held references, from rest, (n_t, 6)."""
        result, state, current = np.empty((len(references), 6)), np.append(x, np.zeros(6)), start_A
        for k, reference in enumerate(references):
            result[k] = state[:6]
            gap = current - reference

            def slope(t: float, y: Array, reference=reference, gap=gap) -> Array:
                now = reference + gap * np.exp(-t / self.lag_s)
                return np.append(y[6:], self.second_rates(y[:6], y[6:], now))

            step = solve_ivp(slope, (0.0, 1.0 / rate_hz), state, rtol=1e-8, atol=1e-10)
            state = step.y[:, -1]
            current = reference + gap * np.exp(-1.0 / (rate_hz * self.lag_s))
        return result

    def quaternion(self, x: Array) -> Array:
        """W x y z of the angles."""
        (sr, sp, sy), (cr, cp, cy) = np.sin(x[3:6] / 2), np.cos(x[3:6] / 2)
        return np.array(
            [
                cr * cp * cy + sr * sp * sy,
                sr * cp * cy - cr * sp * sy,
                cr * sp * cy + sr * cp * sy,
                cr * cp * sy - sr * sp * cy,
            ]
        )
