"""Which frequencies a swing holds: the pass band that loses least to smoothing and to noise."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.robot import Array

LOWEST_PASS_HZ = 5.0  # swings of a heavy platform end below (FIDIM 2022, eq. 38)
HIGHEST_SHARE = 0.12  # of the sampling rate
_CAUTION = 10.0  # the noise's weight: measured best on simulated swings with 0.1 to 0.3 mm
_FLOOR_FROM = 0.6  # of Nyquist: nothing but noise is expected above
_CLEAR = 2.0  # times the noise floor from which a line counts as motion
_LEAST_SAMPLES = 64  # fewer make no spectrum: 0.64 s at 100 Hz


def independent_numbers(series: Array) -> float:
    """How many numbers of a series (n, c) move independently.

    Participation number of the power over frequencies and coordinates: all of them for white
    noise, a few where one mode of the swing holds it.

    Source:
        Blackman, Tukey 1958, The Measurement of Power Spectra: equivalent degrees of
        freedom.
    """
    power = np.abs(np.fft.rfft(series, axis=0)) ** 2
    # The periodogram of white noise scatters by its own mean: hence twice the number.
    return float(2.0 * power.sum() ** 2 / np.sum(power**2))


def best_pass_hz(samples: Array, period_s: float, scale: Array) -> float:
    """Pass band that minimises acceleration cut off above it plus noise let through below it.

    Small swings of a heavy platform are sinusoidal (FIDIM 2022, eq. 38) and end below 5 Hz; wider
    ones carry harmonics that a 10 Hz stop band takes away, and the inertia with them.

    Args:
        samples: one stretch without gaps, (n, n_c).
        period_s: sampling period.
        scale: what makes the coordinates comparable, (n_c,).
    """
    n = len(samples)
    highest = HIGHEST_SHARE / period_s
    if n < _LEAST_SAMPLES or highest <= LOWEST_PASS_HZ:
        return LOWEST_PASS_HZ
    time = np.linspace(-1.0, 1.0, n)[:, None]
    slope = np.sum(time * samples, axis=0) / np.sum(time**2)
    window = np.blackman(n)[:, None]
    level = (samples - samples.mean(axis=0) - slope * time) * scale * window
    power = np.abs(np.fft.rfft(level, axis=0)) ** 2 / np.sum(window**2)
    frequencies = np.fft.rfftfreq(n, period_s)
    top = frequencies > _FLOOR_FROM * 0.5 / period_s
    floor = np.median(power[top], axis=0) / np.log(2.0)  # of an exponential distribution
    lift = (2.0 * np.pi * frequencies) ** 4
    motion = np.where(power > _CLEAR * floor, power - floor, 0.0).sum(axis=1) * lift
    cut = motion.sum() - np.cumsum(motion)
    let_through = np.cumsum(floor.sum() * lift)
    allowed = (frequencies >= LOWEST_PASS_HZ) & (frequencies <= highest)
    return float(frequencies[allowed][np.argmin((cut + _CAUTION * let_through)[allowed])])
