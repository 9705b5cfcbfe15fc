"""What a residual looks like: its spectrum over all runs and what it follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import complex128
from numpy.typing import NDArray

from freeswing.cdpr.robot import Array
from freeswing.ident.likelihood.fit_swings import LikelihoodFit
from freeswing.ident.likelihood.run_residuals import residuals
from freeswing.ident.signals import band

# Runs of 20 s hold three periods of it: what is slower is a drift and has no frequency.
LOWEST_HZ = 0.15
# A mode that the fit could not follow stands out in all runs too, and may do so more than a fan:
# there are three modes at most beside it.
LINES = 4
# Over a run's length: half of the width of a line under a Hann window.
HANN_WIDTH = 2.0
# No calibration or survey can be trusted below this: nothing further is sought in such a residual,
# unless every run's poses state how far they err together.
SMALLEST_RESIDUAL_M = 2e-5
SMALLEST_RESIDUAL_RAD = 1e-4


def residual_powers(fit: LikelihoodFit, noise_scales: Array) -> Array:
    """Mean square of each run's whitened residuals, (r,): one at the noise.

    Source:
        Press et al. 2007, Numerical Recipes, sec. 14.1.
    """
    pairs = zip(fit.motions, fit.samples, strict=True)
    return np.array([np.mean(residuals(m, run, noise_scales) ** 2) for m, run in pairs])


def independent_numbers(fit: LikelihoodFit, noise_scales: Array) -> Array:
    """How many numbers of each run's residual move independently, (r,).

    Participation numbers of the power over frequencies and coordinates: all of them for white
    noise, a few where one mode of the swing holds it.

    Source:
        Blackman, Tukey 1958, The Measurement of Power Spectra: equivalent degrees of
        freedom.
    """
    pairs = zip(fit.motions, fit.samples, strict=True)
    return np.array([band.independent_numbers(residuals(m, run, noise_scales)) for m, run in pairs])


def mean_log_spectrum(fit: LikelihoodFit, noise_scales: Array) -> tuple[Array, Array]:
    """Geometric mean over runs of the whitened residuals' power, one for white noise.

    A line that all runs share stands out of it; the platform's own modes differ from run to run.

    Returns:
        Frequencies in Hz and power, (f,) each.

    Source:
        Percival, Walden 1993, Spectral Analysis for Physical Applications, ch. 6.
    """
    rate = min(1.0 / float(np.median(np.diff(run.times_s))) for run in fit.samples)
    duration = min(run.span_s[1] - run.span_s[0] for run in fit.samples)
    step = 0.25 / duration
    frequencies = np.arange(LOWEST_HZ, 0.4 * rate, step)
    logs = np.zeros(len(frequencies))
    for motion, run in zip(fit.motions, fit.samples, strict=True):
        white = residuals(motion, run, noise_scales)
        window = np.hanning(len(white))
        wave = _transformed(white * window[:, None], run.times_s, len(frequencies), step)
        power = np.abs(wave) ** 2 / np.sum(window**2)
        logs += np.log(power.mean(axis=1) + 1e-12)
    return frequencies, np.exp(logs / len(fit.samples))


def _transformed(series: Array, times_s: Array, count: int, step_hz: float) -> NDArray[complex128]:
    """Fourier transform of a series (n, c) at `count` frequencies from `LOWEST_HZ`, (count, c).

    Every wave is the product of a coarse one and a fine one: few of them have to be computed.
    """
    fine = int(np.ceil(np.sqrt(count)))
    turns = -2j * np.pi * times_s[:, None]
    between = np.exp(turns * step_hz * np.arange(fine))[:, :, None] * series[:, None, :]
    first = LOWEST_HZ + fine * step_hz * np.arange(-(-count // fine))
    found = np.exp(turns * first).T @ between.reshape(len(series), -1)
    return found.reshape(-1, series.shape[1])[:count]


def common_frequencies(
    fit: LikelihoodFit, noise_scales: Array, count: int = LINES
) -> tuple[float, ...]:
    """Where all runs' residuals are strongest against their surroundings, Hz, strongest first.

    Each is a line by itself: two stand apart by at least what a run's length can resolve.

    Args:
        fit: whose residuals.
        noise_scales: of metres and radians, (2,).
        count: at most so many.

    Source:
        Percival, Walden 1993, Spectral Analysis for Physical Applications, ch. 6: a line under a
        Hann window is four resolutions wide.
    """
    frequencies, power = mean_log_spectrum(fit, noise_scales)
    apart = HANN_WIDTH / min(run.span_s[1] - run.span_s[0] for run in fit.samples)
    width = max(5, len(frequencies) // 20) | 1
    padded = np.pad(np.log(power), width // 2, mode="edge")
    around = np.median(np.lib.stride_tricks.sliding_window_view(padded, width), axis=-1)
    prominence = np.log(power) - around
    found: list[float] = []
    while len(found) < count and np.isfinite(prominence).any():
        found.append(float(frequencies[int(np.nanargmax(prominence))]))
        prominence[np.abs(frequencies - found[-1]) < apart] = np.nan
    return tuple(found)


@dataclass(frozen=True, slots=True)
class Residual:
    """What effects may ask of a residual (`cdpr.effects.Clues`).

    Attributes:
        fit: whose residual it is.
        noise_scales: of metres and radians, (2,).
    """

    fit: LikelihoodFit
    noise_scales: Array

    def common_frequencies_hz(self) -> tuple[float, ...]:
        """Those at which all runs' residuals stand out of their surroundings, most so first."""
        return common_frequencies(self.fit, self.noise_scales)


def too_small(fit: LikelihoodFit) -> bool:
    """Whether the residuals are below what any calibration can be trusted to.

    Poses that state how far they err together are trusted to that: it is among the unknowns of
    every model (frames, what all runs share) and in the noise of the samples. Of five effects a
    tilt or the cables' stretch left 0.015 mm, and all nine of inertia wrong.
    """
    if all(run.slow is not None for run in fit.samples):
        return False
    limits = np.array([SMALLEST_RESIDUAL_M, SMALLEST_RESIDUAL_RAD])
    return bool((np.nan_to_num(fit.noise) < limits).all())
