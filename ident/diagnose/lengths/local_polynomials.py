"""Derivatives of samples by local polynomials."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.robot import Array


def local_derivatives(
    times_s: Array, values: Array, over_s: float, degree: int, order: int
) -> Array:
    """Derivatives of samples (n, c) at their times (n,), by polynomials over windows, (n, c).

    A simulated motion would not do: where the model lacks much it is out of phase after a while.

    Args:
        times_s: rising; samples between them are interpolated where they are not regular.
        values: samples, (n, c).
        over_s: how long a window is: at least two samples more than the polynomial has powers.
        degree: of the polynomials.
        order: of the derivative.

    Raises:
        ValueError: for fewer samples than a window has.

    Source:
        Savitzky, Golay 1964, Smoothing and Differentiation of Data by Simplified Least Squares.
    """
    # Half a second to import, which most commands do not need.
    from scipy.signal import savgol_filter

    step = float(np.median(np.diff(times_s)))
    grid = np.arange(times_s[0], times_s[-1] + 0.5 * step, step)
    even = np.array([np.interp(grid, times_s, column) for column in values.T])
    width = min(2 * round(0.5 * over_s / step) + 1, len(grid) - 1 + len(grid) % 2)
    least = degree + 2 + (degree + 1) % 2
    found = savgol_filter(even, max(width, least), degree, deriv=order, delta=step, axis=1)
    return np.array([np.interp(times_s, grid, row) for row in np.asarray(found)]).T
