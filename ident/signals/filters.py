"""Linear-phase FIR smoothers whose derivatives sit on the same time stamps as the position.

Three kernels of one span and one pass band, for the value and its first two derivatives, each a
constrained least-squares design: exact on polynomials to the fourth degree (so no lag, no droop
at low frequency), flat over the pass band, silent from the stop band on. FIDIM 2022, sec. 5.2
asks for the zero-phase low-pass with its stop band at 10 Hz.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from freeswing.cdpr.robot import Array, frozen_array

_GRID = 512  # frequencies of the design, over 0 to Nyquist
_STOP_WEIGHT = 3.0  # a stop-band error weighs this much beside a pass-band one
_EXACT_DEGREE = 4


@dataclass(frozen=True, slots=True)
class Smoother:
    """Kernels for correlation: `value[i] = sum_k kernel[k] sample[i + k - half]`.

    Attributes:
        period_s: sampling period.
        pass_hz: end of the pass band.
        kernels: value, first and second derivative, (3, 2 half + 1).
    """

    period_s: float
    pass_hz: float
    kernels: Array

    @property
    def half(self) -> int:
        """Samples that the kernels reach to either side."""
        return self.kernels.shape[1] // 2

    def response(self, frequencies_hz: Array) -> Array:
        """Gain of each kernel over that of the exact operation (i omega)^d, (3, n_f).

        At zero frequency the exact operation is itself zero for the derivatives: ask above it.
        """
        omega = 2.0 * np.pi * np.asarray(frequencies_hz, dtype=np.float64)
        reach = self.period_s * np.arange(-self.half, self.half + 1)
        phase = np.exp(1j * np.outer(omega, reach))
        exact = (1j * omega[None, :]) ** np.arange(3)[:, None]
        return np.real((self.kernels @ phase.T) / exact)


def taps_for(period_s: float, pass_hz: float, stop_hz: float, attenuation_db: float) -> int:
    """Odd number of taps that Kaiser's formula asks for this transition and attenuation."""
    width = 2.0 * (stop_hz - pass_hz) * period_s  # of the Nyquist frequency
    taps = (attenuation_db - 7.95) / (2.285 * np.pi * width) + 1.0
    return max(7, int(np.ceil(taps))) | 1


@lru_cache(maxsize=128)
def smoother(
    period_s: float, pass_hz: float = 5.0, stop_hz: float = 10.0, attenuation_db: float = 60.0
) -> Smoother:
    """Design the three kernels.

    Args:
        period_s: sampling period.
        pass_hz: end of the pass band.
        stop_hz: start of the stop band; above the Nyquist frequency, the pass band is all there is.
        attenuation_db: sets the span of the kernels.

    Raises:
        ValueError: when the bands are not 0 < pass < stop, or the pass band is above Nyquist.
    """
    nyquist = 0.5 / period_s
    if not 0.0 < pass_hz < stop_hz:
        raise ValueError(f"pass_hz {pass_hz} and stop_hz {stop_hz}: must be 0 < pass < stop")
    if pass_hz >= nyquist:
        raise ValueError(
            f"samples at {1 / period_s:.4g} Hz hold nothing above {nyquist:.4g} Hz, the swing's "
            f"frequencies reach {pass_hz:g} Hz: record at {4.0 * pass_hz:.3g} Hz or faster"
        )
    half = taps_for(period_s, pass_hz, stop_hz, attenuation_db) // 2
    reach: Array = np.arange(-half, half + 1) * np.float64(period_s)
    omega = np.pi / period_s * (np.arange(_GRID) + 0.5) / _GRID
    inside, outside = omega <= 2.0 * np.pi * pass_hz, omega >= 2.0 * np.pi * stop_hz
    weight = np.where(inside | outside, 1.0, 0.0)
    value = _design(0, reach, omega, inside.astype(float), weight)
    # What the value's kernel lets through of each frequency, its derivatives' kernels must too:
    # then a linear law between position and acceleration survives smoothing, transition included.
    gain = np.cos(np.outer(omega, reach)) @ value
    even = np.maximum(omega, 0.2 * np.pi * pass_hz)
    first = _design(1, reach, omega, gain * omega, 1.0 / even)
    second = _design(2, reach, omega, -gain * omega**2, 1.0 / even**2)
    kernels = np.array([value, first, second])
    return Smoother(period_s, pass_hz, frozen_array(kernels, kernels.shape, "kernels"))


def _design(order: int, reach: Array, omega: Array, target: Array, weight: Array) -> Array:
    """Least-squares kernel of derivative `order` with exact polynomial moments, (2 half + 1,).

    Args:
        order: 0, 1 or 2.
        reach: times of the taps, symmetric about 0, (2 half + 1,).
        omega: frequencies of the design, rad/s, (n,).
        target: wanted real (order 0, 2) or imaginary (order 1) gain there, (n,).
        weight: of the errors there, (n,).
    """
    half = len(reach) // 2
    # Only cosines carry an even operation and only sines an odd one, so each design is real.
    even = order % 2 == 0
    waves = np.cos(np.outer(omega, reach)) if even else np.sin(np.outer(omega, reach))
    # Parity of the kernel is imposed by halving the unknowns: k and -k share one coefficient.
    fold = np.zeros((len(reach), half + 1))
    fold[half + np.arange(half + 1), np.arange(half + 1)] = 1.0
    fold[half - np.arange(half + 1), np.arange(half + 1)] = 1.0 if even else -1.0
    fold[half, 0] = 1.0 if even else 0.0
    fold = fold if even else fold[:, 1:]
    rows = weight[:, None] * waves @ fold
    normal = rows.T @ rows
    normal += 1e-12 * np.trace(normal) * np.eye(len(normal))  # settles the transition band
    degrees = np.arange(order % 2, _EXACT_DEGREE + 1, 2)
    span = reach[-1]
    moments = (reach / span) ** degrees[:, None] @ fold
    exact = np.where(degrees == order, [1.0, 1.0, 2.0][order] / span**order, 0.0)
    corner = np.zeros((len(degrees), len(degrees)))
    system = np.block([[normal, moments.T], [moments, corner]])
    right = np.concatenate([rows.T @ (weight * target), exact])
    return fold @ np.linalg.solve(system, right)[: fold.shape[1]]


@lru_cache(maxsize=8)
def forward_difference_smoother(
    period_s: float, pass_hz: float = 5.0, stop_hz: float = 10.0, attenuation_db: float = 60.0
) -> Smoother:
    """The FIDIM authors' processing: zero-phase windowed low-pass, then forward differences.

    The velocity lags the position's time stamp by half a sample and the acceleration by one; kept
    to reproduce the published figures, never used otherwise.
    """
    reach = taps_for(period_s, pass_hz, stop_hz, attenuation_db) // 2
    k = np.arange(-reach, reach + 1)
    beta = 0.1102 * (attenuation_db - 8.7) if attenuation_db > 50.0 else 4.0
    cut = (pass_hz + stop_hz) * period_s  # of Nyquist: the middle of the transition
    low_pass = np.sinc(cut * k) * np.kaiser(len(k), beta)
    value = np.pad(low_pass / low_pass.sum(), 2)
    velocity = (np.roll(value, 1) - value) / period_s
    acceleration = (np.roll(velocity, 1) - velocity) / period_s
    kernels = np.array([value, velocity, acceleration])
    return Smoother(period_s, pass_hz, frozen_array(kernels, kernels.shape, "kernels"))
