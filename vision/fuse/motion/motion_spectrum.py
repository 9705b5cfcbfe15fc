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
from freeswing.vision.fuse.motion.spectrum_kernels import Patterns, Waves, told_by_stretches

Array = NDArray[np.float64]

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

    def without(self, low: float, high: float) -> Spectrum:
        """The same without what lies between two shares of the pose rate; noise is as claimed."""
        whole = np.maximum(self.power + self.excess / BANDS, AS_LARGE)
        out = (_middles() >= low) & (_middles() < high)
        return Spectrum(self.step_s, np.where(out, _LEAST_POWER, whole), 1.0)

    def waves(self) -> Waves:
        """What the kernels take: the bands, then images of those that may be too fast."""
        bands = _middles()
        high = bands > HIGHEST
        power = np.where(high, 0.5, 1.0) * self.power
        hz = np.concatenate([bands, 1.0 - bands[high]]) / self.step_s
        return Waves(
            2.0 * np.pi * hz,
            np.concatenate([power, power[high]]),
            2.0 * np.pi * WIDTH * 0.5 / BANDS / self.step_s,
            _CONSTANT * float(self.power.sum()),
            self.noise,
        )

    def improved(self, patterns: Patterns, steps: Array, rounds: int) -> Spectrum:
        """Nearer to what some stretches of poses are made of, each band as where most of it is.

        Args:
            patterns: times of the poses of each stretch.
            steps: from a pose near the middle, in units of their deviations, (g, n, k).
            rounds: of improvement.

        Source:
            Foerstner, Wrobel 2016, Photogrammetric Computer Vision, sec. 4.2.4: components of
            variance in turns.
        """
        found, squares = self, np.ones((1, BANDS))
        for _ in range(rounds):
            told = told_by_stretches(patterns, steps, found.waves())
            traces, squares = told.traces[:BANDS], told.squares[:, :BANDS]
            power = found.power * squares.mean(axis=0) / np.maximum(traces, 1e-300)
            found = Spectrum(self.step_s, np.maximum(power, _LEAST_POWER), self.noise)
        liveliest = np.max(squares, axis=0) / np.maximum(np.mean(squares, axis=0), 1e-300)
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
