"""Current references with levels and a band of their own for every motor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

KINDS = ("prbs", "multisine")
# What a motor's references are drawn from: levels as shares of its current limit, bands in Hz.
LOW_SHARES = (0.0, 0.1, 0.2, 0.3)
SPANS = (0.2, 0.3, 0.4, 0.5)
BANDS_HZ = (0.5, 1.0, 2.0, 3.0, 5.0)


@dataclass(frozen=True, slots=True)
class Setting:
    """What one motor is driven with.

    Attributes:
        low_A: least reference.
        high_A: greatest.
        band_hz: upper end of its band.
    """

    low_A: float
    high_A: float
    band_hz: float


@dataclass(frozen=True, slots=True)
class References:
    """References of all motors.

    Attributes:
        values: (n_t, n).
        settings: one a motor.
    """

    values: Array
    settings: tuple[Setting, ...]


def drawn(
    kind: str, n_samples: int, rate_hz: float, limits: Array, generator: np.random.Generator
) -> References:
    """References of every motor, limits (n, 2), drawn at random."""
    pairs = [_one(kind, n_samples, rate_hz, limit, generator) for limit in limits]
    return References(np.stack([values for values, _ in pairs], axis=1), tuple(s for _, s in pairs))


def changed(
    kind: str,
    now: References,
    rate_hz: float,
    limits: Array,
    motors: NDArray[np.int64],
    generator: np.random.Generator,
) -> References:
    """The same with some motors drawn anew."""
    values, settings = now.values.copy(), list(now.settings)
    for motor in motors:
        values[:, motor], settings[motor] = _one(
            kind, len(values), rate_hz, limits[motor], generator
        )
    return References(values, tuple(settings))


def _one(
    kind: str, n_samples: int, rate_hz: float, limits: Array, generator: np.random.Generator
) -> tuple[Array, Setting]:
    low = limits[0] + float(generator.choice(LOW_SHARES)) * (limits[1] - limits[0])
    span = float(generator.choice(SPANS)) * (limits[1] - limits[0])
    band = float(generator.choice(BANDS_HZ))
    setting = Setting(low, min(low + span, float(limits[1])), band)
    wave = _prbs if kind == "prbs" else _multisine
    shape = wave(n_samples, rate_hz, band, generator)
    return setting.low_A + (setting.high_A - setting.low_A) * shape, setting


def _prbs(n: int, rate_hz: float, band_hz: float, generator: np.random.Generator) -> Array:
    """Zeros and ones held half a period of the band's end, begun at any place of it, (n,)."""
    hold = max(1, round(rate_hz / (2.0 * band_hz)))
    bits = generator.integers(0, 2, n // hold + 2)
    first = int(generator.integers(hold))
    return np.repeat(bits, hold)[first : first + n].astype(np.float64)


def _multisine(n: int, rate_hz: float, band_hz: float, generator: np.random.Generator) -> Array:
    """All harmonics of the record up to the band's end with random phases, within 0 to 1, (n,)."""
    t = np.arange(n) / rate_hz
    count = max(1, int(band_hz * n / rate_hz))
    phases = generator.uniform(0.0, 2.0 * np.pi, count)
    rates = 2.0 * np.pi * np.arange(1, count + 1) * rate_hz / n
    wave = np.sin(np.outer(t, rates) + phases).sum(axis=1)
    return 0.5 + 0.5 * wave / np.abs(wave).max()
