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

from cdpr.robot import Array, frozen_array

_GRID = 512  # frequencies of the design, over 0 to Nyquist
_STOP_WEIGHT = 3.0  # a stop-band error weighs this much beside a pass-band one
_EXACT_DEGREE = 4


@dataclass(frozen=True, slots=True)
class Smoother:
    """Kernels for correlation: `value[i] = sum_k kernel[k] sample[i + k - half]`.

    Attributes:
        period_s: sampling period.
        kernels: value, first and second derivative, (3, 2 half + 1).
    """

    period_s: float
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


@lru_cache(maxsize=32)
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
            f"pass_hz {pass_hz}: samples at {1 / period_s:.4g} Hz hold nothing above "
            f"{nyquist:.4g} Hz; lower pass_hz or record faster"
        )
    half = taps_for(period_s, pass_hz, stop_hz, attenuation_db) // 2
    kernels = np.array([_design(d, half, period_s, pass_hz, stop_hz) for d in range(3)])
    return Smoother(period_s, frozen_array(kernels, kernels.shape, "kernels"))


def _design(order: int, half: int, period_s: float, pass_hz: float, stop_hz: float) -> Array:
    """Least-squares kernel of derivative `order` with exact polynomial moments, (2 half + 1,)."""
    k = np.arange(-half, half + 1)
    reach = k * period_s
    omega = np.pi / period_s * (np.arange(_GRID) + 0.5) / _GRID
    pass_, stop = 2.0 * np.pi * pass_hz, 2.0 * np.pi * stop_hz
    # Only cosines carry an even operation and only sines an odd one, so each design is real.
    even = order % 2 == 0
    waves = np.cos(np.outer(omega, reach)) if even else np.sin(np.outer(omega, reach))
    sign = -1.0 if order == 2 else 1.0
    target = np.where(omega <= pass_, sign * omega**order, 0.0)
    # Relative errors count alike over the pass band; in the stop band, relative to its edge.
    weight = np.where(omega <= pass_, np.maximum(omega, 0.1 * pass_) ** -order, 0.0)
    weight = np.where(omega >= stop, _STOP_WEIGHT / pass_**order, weight)
    rows, goal = weight[:, None] * waves, weight * target
    normal = rows.T @ rows + 1e-9 * np.eye(len(k))  # the ridge settles the transition band
    degrees = np.arange(order % 2, _EXACT_DEGREE + 1, 2)
    scale = half * period_s
    moments = (reach[None, :] / scale) ** degrees[:, None]
    exact = np.where(degrees == order, [1.0, 1.0, 2.0][order] / scale**order, 0.0)
    # Parity of the kernel is imposed by halving the unknowns: k and -k share one coefficient.
    fold = np.zeros((len(k), half + 1))
    fold[half + np.arange(half + 1), np.arange(half + 1)] = 1.0
    fold[half - np.arange(half + 1), np.arange(half + 1)] = 1.0 if even else -1.0
    fold[half, 0] = 1.0 if even else 0.0
    if not even:
        fold = fold[:, 1:]
    system = np.block(
        [
            [fold.T @ normal @ fold, (moments @ fold).T],
            [moments @ fold, np.zeros((len(degrees), len(degrees)))],
        ]
    )
    right = np.concatenate([fold.T @ rows.T @ goal, exact])
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
    return Smoother(period_s, frozen_array(kernels, kernels.shape, "kernels"))
