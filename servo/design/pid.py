"""PID with two numbers: how fast positions and orientations are to be.

The same gains at every motor are, seen from the platform, a PID whose mass is J~' J~ times what
one motor feels: joint space and task space are one formula with two masses.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

from freeswing.servo.synthesis.state_space import Array, StateSpace

# The derivative is filtered this many times faster than the loop: less costs phase, more noise.
FILTER = 10.0
# A derivative filtered slower than ten times the robot's fastest mode lags where that mode is.
BEYOND_MODES = 10.0


def slowest_filters(fastest_modes_rad_s: Array) -> Array:
    """How slow the derivative's filter of each axis may be, (6,), by the fastest mode it meets."""
    return np.where(fastest_modes_rad_s > 0.0, BEYOND_MODES * fastest_modes_rad_s, 0.0)


def task_pid(mass: Array, speeds_rad_s: Array, slowest_filter_rad_s: Array) -> StateSpace:
    """Pose error to wrench: M_o times the gains that put three poles of 1/s^2 at -speed.

    Args:
        mass: M_o, (6, 6): it takes the axes apart.
        speeds_rad_s: the triple pole of each axis, (6,).
        slowest_filter_rad_s: the derivative's filter is at least so fast, (6,): beyond the
            robot's own resonances, or its lag feeds them.
    """
    w = np.asarray(speeds_rad_s, dtype=np.float64)
    n = np.maximum(FILTER * w, slowest_filter_rad_s)
    zero = np.zeros((6, 6))
    A = np.asarray(scipy.linalg.block_diag(zero, -np.diag(n)), dtype=np.float64)
    B = np.vstack([np.eye(6), np.diag(n)])
    C = np.hstack([mass * w**3, -mass * (3.0 * w * n)])
    return StateSpace(A, B, C, mass * (3.0 * w**2 + 3.0 * w * n))
