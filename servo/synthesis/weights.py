"""The weights of the four-block problem (the paper's eq. (24))."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.servo.synthesis.state_space import Array, StateSpace, append, gain, series


@dataclass(frozen=True, slots=True)
class Filter:
    """(gain (s + zero) / (s + pole)) ** order; order 0 is the bare gain."""

    gain: float
    zero_rad_s: float = 0.0
    pole_rad_s: float = 0.0
    order: int = 0

    def __post_init__(self) -> None:
        if not self.gain > 0.0:
            raise ValueError(f"a weight's gain is {self.gain:g}: it must be positive")
        if self.order < 0 or self.order > 4:
            raise ValueError(f"a weight's order is {self.order}: 0 to 4 are possible")
        if self.order and not self.pole_rad_s > 0.0:
            raise ValueError(
                f"a weight's pole_rad_s is {self.pole_rad_s:g}: it must be positive (a pole on "
                "the imaginary axis leaves no finite gamma; write 1e-4 for an integrator)"
            )
        if self.order and not self.zero_rad_s >= 0.0:
            raise ValueError(f"a weight's zero_rad_s is {self.zero_rad_s:g}: it must be >= 0")

    def at(self, rates_rad_s: Array) -> Array:
        """Size at the given rates."""
        s = 1j * np.asarray(rates_rad_s, dtype=np.float64)
        if self.order == 0:
            return np.full(s.shape, self.gain)
        return np.abs(self.gain * (s + self.zero_rad_s) / (s + self.pole_rad_s)) ** self.order

    def system(self) -> StateSpace:
        """One input, one output; each state carries an equal share of the gain in and out."""
        if self.order == 0:
            return gain(np.array([[self.gain]]))
        slope = self.gain * (self.zero_rad_s - self.pole_rad_s)
        share = np.sqrt(abs(slope))
        one = StateSpace(
            np.array([[-self.pole_rad_s]]),
            np.array([[share]]),
            np.array([[np.sign(slope) * share]]),
            np.array([[self.gain]]),
        )
        whole = one
        for _ in range(self.order - 1):
            whole = series(whole, one)
        return whole

    def faster(self, share: float, slope: int) -> Filter:
        """The filter that is to its own what `share ** slope` times it is at rates / share."""
        if self.order == 0:
            return Filter(self.gain * share**slope)
        gain = self.gain * share ** (slope / self.order)
        return Filter(gain, self.zero_rad_s * share, self.pole_rad_s * share, self.order)


@dataclass(frozen=True, slots=True)
class Part:
    """The three weights of one half of the pose: error, control, disturbance."""

    w1: Filter
    w2: Filter
    w3: Filter

    def faster(self, share: float) -> Part:
        """The goals of a loop `share` times as fast around 1/s^2: margins stay, rates move."""
        return Part(self.w1.faster(share, 0), self.w2.faster(share, -2), self.w3.faster(share, 2))


@dataclass(frozen=True, slots=True)
class Weights:
    """Weights of positions and forces, and of orientations and moments."""

    position: Part
    orientation: Part

    def faster(self, share: float) -> Weights:
        """Both halves with their rates times a share."""
        return Weights(self.position.faster(share), self.orientation.faster(share))

    def error(self) -> StateSpace:
        """W1, six by six."""
        return self._six("w1")

    def control(self) -> StateSpace:
        """W2, six by six."""
        return self._six("w2")

    def disturbance(self) -> StateSpace:
        """W3, six by six."""
        return self._six("w3")

    def _six(self, name: str) -> StateSpace:
        first = getattr(self.position, name).system()
        second = getattr(self.orientation, name).system()
        return append(first, first, first, second, second, second)
