"""LQG with integral action: a Kalman filter and a regulator, as fast as two numbers say."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from freeswing.servo.synthesis.state_space import Array, StateSpace

# The filter is this many times faster than the regulator: slower and it eats the phase margin,
# faster and it passes the camera's noise on.
FILTER_RATIO = 2.0


@dataclass(frozen=True, slots=True)
class Lqg:
    """The parts of an LQG controller.

    Attributes:
        system: pose error to wrench.
        gain: K of u = -K [plant states; integrals], (6, n + 6).
        observer: L of the Kalman filter, (n, 6).
    """

    system: StateSpace
    gain: Array
    observer: Array


def design_lqg(plant: StateSpace, mass: Array, speeds_rad_s: Array) -> Lqg:
    """The controller of given speeds.

    The regulator weighs the error's integral by speed^6, the pose by 3 speed^4, its rate by 3
    speed^2 and the wrench by M_o^-2: of 1/s^2 three poles at -speed, and modes that springs make
    faster than that are damped. The filter takes white wrenches of M_o^2 speed^4 against white
    pose noise, a Butterworth pattern `FILTER_RATIO` faster.

    Args:
        plant: wrench to pose, its states pose and rate, then those of its delay.
        mass: M_o, (6, 6).
        speeds_rad_s: radius of the regulator's poles for each axis, (6,).
    """
    n, m = plant.order, plant.n_outputs
    speeds = np.asarray(speeds_rad_s, dtype=np.float64)
    A = np.block([[plant.A, np.zeros((n, m))], [plant.C, np.zeros((m, m))]])
    B = np.vstack([plant.B, np.zeros((m, m))])
    inverse = np.linalg.inv(mass)
    states = np.full(n, 1e-9)
    states[:m], states[m : 2 * m] = 3.0 * speeds**4, 3.0 * speeds**2
    Q = np.diag(np.concatenate([states, speeds**6]))
    R = inverse.T @ inverse
    X = scipy.linalg.solve_continuous_are(A, B, Q, R)
    gain = np.linalg.solve(R, B.T @ X)
    drive = plant.B @ mass * (FILTER_RATIO * speeds) ** 2
    Y = scipy.linalg.solve_continuous_are(
        plant.A.T, plant.C.T, drive @ drive.T + 1e-9 * np.eye(n), np.eye(m)
    )
    observer = Y @ plant.C.T
    # The observer sees -e = y - r and drives the integrals with it: r enters nowhere else.
    Kx, Ki = gain[:, :n], gain[:, n:]
    top = np.hstack([plant.A - plant.B @ Kx - observer @ plant.C, -plant.B @ Ki])
    whole = np.vstack([top, np.zeros((m, n + m))])
    inputs = -np.vstack([observer, np.eye(m)])
    return Lqg(StateSpace(whole, inputs, -gain, np.zeros((m, m))), gain, observer)
