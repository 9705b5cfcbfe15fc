"""Derivatives of regular samples by local polynomials.

`scipy.signal.savgol_filter` gives the same; importing it takes half a second, of statistics
mostly.
"""

from __future__ import annotations

import math

import numpy as np

from freeswing.cdpr.robot import Array


def local_derivatives(values: Array, width: int, degree: int, order: int, step_s: float) -> Array:
    """Derivatives of rows (c, n), in the middle of windows; at both ends along the last window.

    Args:
        values: samples, (c, n).
        width: of a window, odd, in samples.
        degree: of the polynomials.
        order: of the derivative.
        step_s: from sample to sample.

    Raises:
        ValueError: for a window that is wider than the rows.

    Source:
        Savitzky, Golay 1964, Smoothing and Differentiation of Data by Simplified Least Squares.
    """
    half = width // 2
    at = (np.arange(width) - half) / half
    powers = np.arange(degree + 1)
    falling = np.array([math.perm(k, order) for k in powers])
    slopes = falling * at[:, None] ** np.maximum(powers - order, 0)
    matrix = slopes @ np.linalg.pinv(at[:, None] ** powers) / (half * step_s) ** order
    windows = np.lib.stride_tricks.sliding_window_view(values, width, axis=1)
    ends = windows[:, 0] @ matrix[:half].T, windows[:, -1] @ matrix[half + 1 :].T
    return np.concatenate([ends[0], windows @ matrix[half], ends[1]], axis=1)
