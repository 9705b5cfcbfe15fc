"""Whether residuals are coloured: their power where platforms swing, beside white noise's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.cdpr.robot import Array

LOW_BAND_HZ = 5.0  # hanging platforms swing at 0.3 to 3 Hz: what a model misses follows them
COLOURED = 1.2  # correlation from which residuals are not white


def enlargement(correlation: float) -> float:
    """By which a covariance is larger than white residuals of this colour would make it."""
    return correlation if correlation > COLOURED else 1.0


def low_band_factor(series: Sequence[tuple[Array, Array]]) -> float:
    """Power of series (n, c), each with its times (n,), below 5 Hz over that of white noise."""
    low, whole = 0.0, 0.0
    for white, times_s in series:
        power = np.abs(np.fft.rfft(white, axis=0)) ** 2
        frequencies = np.fft.rfftfreq(len(white), float(np.median(np.diff(times_s))))
        inside = (frequencies > 0.0) & (frequencies <= LOW_BAND_HZ)
        low += float(power[inside].mean(axis=0).sum())
        whole += float(power[1:].mean(axis=0).sum())
    return low / whole if whole > 0 else 1.0
