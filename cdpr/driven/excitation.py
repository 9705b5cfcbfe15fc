"""Current references that excite a driven robot: PRBS, one motor after another, ramps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def prbs(
    n_samples: int,
    n_motors: int,
    rate_hz: float,
    levels_A: tuple[float, float],
    band_hz: float,
    generator: np.random.Generator,
) -> Array:
    """Decoupled random binary references of a band [0, band_hz], (n_samples, n_motors).

    Each motor's bit is drawn anew every half period of the band's upper end, all at once.

    Raises:
        ValueError: for a band that the sample rate cannot hold.

    Source:
        Ljung 1999, System Identification, sec. 13.3.
    """
    hold = round(rate_hz / (2.0 * band_hz)) if band_hz > 0.0 else 0
    if hold < 1:
        raise ValueError(f"a band of {band_hz:g} Hz does not fit {rate_hz:g} samples a second")
    bits = generator.integers(0, 2, (-(-n_samples // hold), n_motors))
    low, high = levels_A
    return low + (high - low) * np.repeat(bits, hold, axis=0)[:n_samples].astype(np.float64)


def steps(n_samples: int, n_motors: int, levels_A: tuple[float, float]) -> Array:
    """One motor after another at the upper level, all others at the lower, (n_samples, n).

    Source:
        INCA 2016, sec. 4.2.2: one motor's current, the rest low.
    """
    low, high = levels_A
    turn = np.minimum(np.arange(n_samples) * n_motors // n_samples, n_motors - 1)
    return np.where(turn[:, None] == np.arange(n_motors), high, low).astype(np.float64)


def ramp(
    n_samples: int,
    n_motors: int,
    rate_hz: float,
    levels_A: tuple[float, float],
    slope_A_s: float,
    motor: int,
) -> Array:
    """One motor's reference rising evenly and then held, all others at the lower level.

    Source:
        INCA 2016, sec. 4.2.1: the friction test.
    """
    low, high = levels_A
    result = np.full((n_samples, n_motors), low)
    result[:, motor] = np.minimum(low + slope_A_s * np.arange(n_samples) / rate_hz, high)
    return result
