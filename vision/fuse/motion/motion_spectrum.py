"""Of which frequencies a platform's motion is made, as the poses of a run themselves tell.

A platform that swings is a sum of a few oscillations, and slow. Its spectrum is told in narrow
bands up to half the pose rate, by components of variance: poses in units of their deviations are

    y = x + noise,   cov(x_i, x_j) = exp(-(2 pi w t_ij)^2 / 2) sum_b P_b cos(2 pi f_b t_ij)

and all coordinates share the shares P_b. Bands that hold nothing end up without variance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.frozen import freeze

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BANDS = 24
"""As many as 48 poses tell apart."""
WIDTH = 0.6
"""Of a band, in steps to the next: all together leave no gap."""
HIGHEST = 0.42
"""Of the pose rate. A faster oscillation looks the same as one that is as much too fast: both then
are taken to be likely, which leaves open what lies between two poses."""
AS_LARGE = 1.0
"""Of the poses' noise: a faster oscillation of less variance changes nothing that is claimed."""
_CONSTANT = 4.0  # poses differ from any of them by up to twice their deviation
_LEAST_POWER = 1e-4  # of a band; noise puts 0.04 there


@dataclass(frozen=True, slots=True)
class Spectrum:
    """What a motion is made of.

    Attributes:
        step_s: from pose to pose.
        power: variance in each band, in units of that of the poses' noise, (b,).
        noise: of the poses about it, in units of what they claim.
    """

    step_s: float
    power: Array
    noise: float

    def __post_init__(self) -> None:
        freeze(self, "power")

    @staticmethod
    def unknown(step_s: float, variance: float) -> Spectrum:
        """All frequencies alike."""
        return Spectrum(step_s, np.full(BANDS, max(variance, 1.0) / BANDS), 1.0)

    @property
    def excess(self) -> float:
        """What poses scatter by about it beyond what they claim."""
        return max(self.noise - 1.0, 0.0)

    @property
    def too_fast_hz(self) -> float | None:
        """The strongest oscillation that may be a faster one's image; None where none is seen."""
        high = np.where(_middles() > HIGHEST, self.power, 0.0)
        if high.sum() <= AS_LARGE * self.noise:
            return None
        return float(_middles()[np.argmax(high)] / self.step_s)

    def waves(self) -> tuple[Array, Array]:
        """Frequencies in rad/s and their shares of the power, (m,) each."""
        bands = _middles()
        high = bands > HIGHEST
        power = np.where(high, 0.5, 1.0) * self.power
        hz = np.concatenate([bands, 1.0 - bands[high]]) / self.step_s
        return 2.0 * np.pi * hz, np.concatenate([power, power[high]])

    @property
    def width(self) -> float:
        """Of each band, rad/s."""
        return 2.0 * np.pi * WIDTH * 0.5 / BANDS / self.step_s

    def covariance(self, one_s: Array, other_s: Array) -> Array:
        """Of the motion at times (..., a) and (..., b), (..., a, b)."""
        return self.slopes(one_s, other_s, 0)[0]

    def slopes(self, one_s: Array, other_s: Array, count: int = 2) -> list[Array]:
        """The covariance and its derivatives by the first times, (..., a, b) each."""
        waves, power = self.waves()
        here, there = one_s[..., None] * waves, other_s[..., None] * waves
        cosines, sines = np.cos(there).swapaxes(-1, -2), np.sin(there).swapaxes(-1, -2)
        c, s = np.cos(here) * power, np.sin(here) * power
        apart = one_s[..., :, None] - other_s[..., None, :]
        w2 = self.width**2
        envelope = np.exp(-0.5 * w2 * apart**2)
        plain = c @ cosines + s @ sines
        found = [envelope * plain + _CONSTANT * float(self.power.sum())]
        if count:
            first = (c * waves) @ sines - (s * waves) @ cosines
            second = -((c * waves**2) @ cosines + (s * waves**2) @ sines)
            fall = -w2 * apart
            found.append(envelope * (first + fall * plain))
            found.append(envelope * (second + 2.0 * fall * first + (fall**2 - w2) * plain))
        return found

    def inverse(self, times_s: Array, known: Mask) -> Array:
        """Of the covariance of poses with their noise, zero where not known, (..., n, n)."""
        both = known[..., :, None] & known[..., None, :]
        whole = np.where(both, self.covariance(times_s, times_s), 0.0)
        whole += np.eye(times_s.shape[-1]) * np.where(known, self.noise, 1.0)[..., None]
        return np.where(both, np.linalg.inv(whole), 0.0)

    def improved(self, times_s: Array, steps: Array, known: Mask, rounds: int) -> Spectrum:
        """Nearer to what some stretches of poses are made of, each band as where most of it is.

        Args:
            times_s: of the poses of each stretch, (g, n).
            steps: from a pose near the middle, in units of their deviations, (g, n, k).
            known: (g, n).
            rounds: of improvement.

        Source:
            Foerstner, Wrobel 2016, Photogrammetric Computer Vision, sec. 4.2.4: components of
            variance in turns.
        """
        arms = times_s[..., None] * (2.0 * np.pi / self.step_s * _middles())
        shapes = np.concatenate([np.cos(arms), np.sin(arms)], axis=-1).swapaxes(-1, -2)
        apart = times_s[..., :, None] - times_s[..., None, :]
        envelope = np.exp(-0.5 * self.width**2 * apart**2)

        def by_band(matrices: Array) -> Array:
            each = ((shapes @ (envelope * matrices)) * shapes).sum(axis=(0, 2))
            return np.asarray(each.reshape(2, BANDS).sum(axis=0))

        found, pulled = self, steps
        for _ in range(rounds):
            inverse = found.inverse(times_s, known)
            pulled = inverse @ steps
            squares = by_band(pulled @ pulled.swapaxes(-1, -2)) / steps.shape[-1]
            power = found.power * squares / np.maximum(by_band(inverse), 1e-300)
            found = Spectrum(self.step_s, np.maximum(power, _LEAST_POWER), self.noise)
        each = [
            by_band(one[..., :, None] * one[..., None, :]) for one in np.moveaxis(pulled, -1, 0)
        ]
        liveliest = np.max(each, axis=0) / np.maximum(np.mean(each, axis=0), 1e-300)
        return Spectrum(self.step_s, found.power * np.maximum(liveliest, 1.0), self.noise)

    def with_noise(self) -> Spectrum:
        """What lies alike in most of the upper half of the bands is noise of the poses.

        Source:
            Huber, Ronchetti 2009, Robust Statistics, ch. 1: the median, which a few lines do not
            move.
        """
        alike = float(np.median(self.power[BANDS // 2 :]))
        power = np.maximum(self.power - alike, _LEAST_POWER)
        return Spectrum(self.step_s, power, 1.0 + BANDS * alike)


def _middles() -> Array:
    """Of the bands, of the pose rate, (b,)."""
    return (np.arange(BANDS) + 0.25) / BANDS * 0.5
