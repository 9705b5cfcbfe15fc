"""A sampled linear controller that does not wind up where the motors give less than it asks."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from freeswing.servo.synthesis.state_space import Array, StateSpace

# How much the anti-windup trusts the outputs against the states: 1 settles the states on what was
# applied within about the controller's own slowest useful time constant.
OUTPUT_NOISE = 1.0


class LinearRegulator:
    """A sampled linear controller whose states follow what was applied, not what was asked.

    x' = A x + B e + M (u applied - u asked), with A - M C stable: a controller that asks for more
    than the motors give does not wind up. M is the gain of a Kalman filter for (A, C).

    Args:
        system: sampled at the control rate.
    """

    def __init__(self, system: StateSpace) -> None:
        if system.period_s is None:
            raise ValueError("a continuous system cannot be stepped: sample it first")
        self._system = system
        self._state = np.zeros(system.order)
        self._next = np.zeros(system.order)
        self._asked = np.zeros(system.n_outputs)
        self._catch = _catching_gain(system)

    def wrench(self, error: Array, asked: Array, new: bool) -> Array:
        """One sample."""
        k = self._system
        self._asked = k.C @ self._state + k.D @ error
        self._next = k.A @ self._state + k.B @ error
        return self._asked

    def applied(self, wrench: Array) -> None:
        """End of the sample."""
        self._state = self._next + self._catch @ (wrench - self._asked)


def _catching_gain(system: StateSpace) -> Array:
    scale = np.maximum(np.abs(system.C).max(axis=1), 1e-12)
    C = system.C / scale[:, None]
    Q = system.B @ system.B.T
    Q = Q / max(np.abs(Q).max(), 1e-300) + 1e-9 * np.eye(system.order)
    X = scipy.linalg.solve_discrete_are(system.A.T, C.T, Q, OUTPUT_NOISE * np.eye(system.n_outputs))
    gain = system.A @ X @ C.T @ np.linalg.inv(C @ X @ C.T + OUTPUT_NOISE * np.eye(len(C)))
    return gain / scale
