"""Continuous systems as the sampled ones that a computer runs, and delays as systems."""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg

from freeswing.servo.synthesis.state_space import StateSpace, append


def zero_order_hold(system: StateSpace, period_s: float) -> StateSpace:
    """Exact at the sampling instants for inputs held between them.

    Raises:
        ValueError: for a period that is not positive, or where a pole is too fast for it.
    """
    if not period_s > 0.0:
        raise ValueError(f"a sampling period of {period_s:g} s: it must be positive")
    if system.period_s is not None:
        raise ValueError("the system is discrete already")
    n, m = system.order, system.n_inputs
    whole = np.zeros((n + m, n + m))
    whole[:n, :n], whole[:n, n:] = system.A, system.B
    step = np.asarray(scipy.linalg.expm(whole * period_s), dtype=np.float64)
    return StateSpace(step[:n, :n], step[:n, n:], system.C, system.D, period_s)


def pade(delay_s: float, order: int, channels: int) -> StateSpace:
    """All-pass of the given order that stands for a delay, the same in every channel.

    Order 2 has the delay's phase to 1 degree up to 1.7 / delay_s rad/s.
    """
    if not delay_s > 0.0 or order < 1:
        raise ValueError(f"a delay of {delay_s:g} s at order {order}: both must be positive")
    down = [
        math.factorial(2 * order - k)
        * math.factorial(order)
        / (math.factorial(2 * order) * math.factorial(k) * math.factorial(order - k))
        for k in range(order + 1)
    ]
    # Time in units of the delay keeps the companion form well scaled.
    den = np.array(down[::-1])
    num = den * np.array([(-1.0) ** k for k in range(order, -1, -1)])
    den, num = den / den[0], num / den[0]
    A = np.zeros((order, order))
    A[0], A[1:, :-1] = -den[1:], np.eye(order - 1)
    B = np.zeros((order, 1))
    B[0] = 1.0
    C = (num[1:] - num[0] * den[1:])[None, :]
    one = StateSpace(A / delay_s, B / delay_s, C, np.array([[num[0]]]))
    return append(*[one] * channels)
