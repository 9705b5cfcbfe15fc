"""What stretches of a recording without a gap look like, and how unlike them some frames are.

Every covariance is made once, of so many stretches at most: a recording ten times as long takes
ten times as long.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

STRAINED = 6.5
"""Mean square of what eight frames leave of a quintic, in what they usually leave: of 850
stretches of samples/filmed 6.4 at most, with one frame lost inside 11 and more."""
AROUND = 2.0
"""All stretches about a gap leave so much, those beside it do not: one in twenty does by chance."""
FITS = 3.0
"""Mean square of a stretch in the usual ones' covariance; 2.4 at most where nothing was lost."""
LEAST_STRETCHES = 20
"""Six coordinates of so many stretches know the covariance of twenty numbers."""
_MOST_STRETCHES = 1000
"""Evenly over the recording: six coordinates of these know thirty variances to 2 %."""
_READING = 0.05
"""Of the noise's variance: few stretches make some combinations seem to vanish."""
_TOGETHER = 8
"""Frames that a quintic is held against: two numbers are left of each coordinate."""
_LONGEST = 12
"""Eight frames among which more are missing by the stamps are no smooth piece of a swing."""
_NORMAL_BY_MAD = 1.4826
NO_STEPS = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Usual:
    """The Gaussian of stretches of one pattern, of each coordinate alike.

    Attributes:
        precision: of the samples, blind to their mean, (n, n).
        scale: logarithm of the covariance's determinant.
    """

    precision: Array
    scale: float

    def squares(self, values: Array) -> Array:
        """Squares of stretches (b, n, m) in this covariance, (b,).

        Source:
            Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3: Mahalanobis distance.
        """
        return np.einsum("bpx,bpx->b", values, self.precision @ values)

    def ahead(self, seen: Ints, values: Array) -> tuple[Array, Array]:
        """All samples (n, m) by those at some places, and the covariance of what is expected.

        Source:
            Bishop 2006, Pattern Recognition and Machine Learning, eq. 2.96: conditional Gaussians.
        """
        count = len(self.precision)
        unseen = np.setdiff1d(np.arange(count), seen)
        covariance = np.linalg.inv(self.precision[np.ix_(unseen, unseen)])
        samples = np.zeros((count, values.shape[1]))
        samples[seen] = values
        samples[unseen] = -covariance @ self.precision[np.ix_(unseen, seen)] @ values
        full = np.eye(count)
        full[np.ix_(unseen, unseen)] = covariance
        return samples, full


class Stretches:
    """Frames of a recording by how they lie to each other.

    Args:
        numbers: of all frames, as far as is known, rising, (n,).
        values: of all coordinates, in noise, (n, m).
        broken: steps that no stretch may hold.
    """

    def __init__(self, numbers: Ints, values: Array, broken: Ints) -> None:
        """Keeps what is asked of."""
        self.numbers, self.values = numbers, values
        self._broken = np.sort(broken)
        self._place = np.full(int(numbers[-1]) + 1, -1, dtype=np.int64)
        self._place[numbers] = np.arange(len(numbers))
        self._usual: dict[tuple[int, ...], Usual | None] = {}

    def pattern(self, rows: Ints) -> Ints:
        """How frames (.., n) lie to the first of them."""
        return self.numbers[rows] - self.numbers[rows[..., :1]]

    def alike(self, pattern: Ints) -> Ints:
        """Indices of frames that lie to each other as the pattern does, (stretches, n)."""
        starts = self.numbers[self.numbers <= self.numbers[-1] - pattern[-1]]
        found = self._place[starts[:, None] + pattern]
        return found[(found >= 0).all(axis=1)]

    def usual(self, pattern: Ints) -> Usual | None:
        """What stretches of a pattern look like; None where there are too few."""
        key = tuple(pattern.tolist())
        if key not in self._usual:
            self._usual[key] = self._made(pattern)
        return self._usual[key]

    def compared(self, pattern: Ints) -> Ints:
        """Stretches of a pattern without a broken step, evenly over the recording."""
        rows = self.alike(pattern)
        before = np.searchsorted(self._broken, rows[:, 0])
        rows = rows[before == np.searchsorted(self._broken, rows[:, -1])]
        return rows[:: max(-(-len(rows) // _MOST_STRETCHES), 1)]

    def _made(self, pattern: Ints) -> Usual | None:
        rows = self.compared(pattern)
        if len(rows) < LEAST_STRETCHES:
            return None
        base = _differences(len(pattern))  # where the platform hangs tells nothing
        seen = self.values[rows.T].reshape(len(pattern), -1)
        covariance = base @ (seen @ seen.T) @ base.T / seen.shape[1] + _READING * np.eye(len(base))
        precision = base.T @ np.linalg.solve(covariance, base)
        return Usual(precision, float(np.linalg.slogdet(covariance)[1]))

    def unlikeliness(self, frames: Ints, pattern: Ints) -> tuple[float, float] | None:
        """Minus twice the log likelihood of frames that lie so, and mean square a number.

        None where too few stretches without a broken step have that pattern.

        Source:
            Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3: a Gaussian's
            likelihood.
        """
        usual = self.usual(pattern)
        if usual is None:
            return None
        square = float(usual.squares(self.values[frames][None])[0])
        count = self.values.shape[1]
        return square + count * usual.scale, square / (count * (len(pattern) - 1))


@cache
def _differences(count: int) -> Array:
    return contrasts(np.arange(count), 0)


def contrasts(pattern: Ints, degree: int) -> Array:
    """Unit combinations of samples at these times that polynomials leave alone, (c, n).

    Source:
        Golub, Van Loan 2013, Matrix Computations, sec. 5.2: the complete QR factors.
    """
    x = 2.0 * (pattern - pattern[0]) / (pattern[-1] - pattern[0]) - 1.0
    q, _ = np.linalg.qr(np.vander(x, degree + 1), mode="complete")
    return np.asarray(q[:, degree + 1 :].T)


def in_noise(numbers: Ints, values: Array) -> Array:
    """Coordinates (n, 6) about their mean, in what cubics through six frames leave of them.

    Source:
        Rousseeuw, Croux 1993, Alternatives to the median absolute deviation, for the scale.
    """
    stretches = Stretches(numbers, values, NO_STEPS)
    rows = np.arange(len(numbers) - 5)[:, None] + np.arange(6)
    patterns, often = np.unique(stretches.pattern(rows), axis=0, return_counts=True)
    pattern = patterns[often.argmax()]  # of a film that repeats every fifth frame not six on end
    alike = stretches.alike(pattern)
    left = np.einsum("cp,bpx->bcx", contrasts(pattern, 3), values[alike])
    noise = _NORMAL_BY_MAD * np.median(np.abs(left), axis=(0, 1))
    return np.asarray((values - values.mean(axis=0)) / np.maximum(noise, 1e-12))


def strained_steps(numbers: Ints, values: Array) -> set[int]:
    """Frames after which every stretch over the step is strained.

    Args:
        numbers: of the frames, as far as is known, rising, (n,).
        values: of all coordinates, (n, m).

    Source:
        Rousseeuw, Croux 1993, Alternatives to the median absolute deviation, for the scale.
    """
    least, most = np.full(len(values), np.inf), np.zeros(len(values))
    rows = np.arange(len(numbers) - _TOGETHER + 1)[:, None] + np.arange(_TOGETHER)
    stretches = Stretches(numbers, values, NO_STEPS)
    patterns = stretches.pattern(rows)
    for pattern in np.unique(patterns, axis=0):
        if pattern[-1] > _LONGEST or len(alike := stretches.alike(pattern)) < LEAST_STRETCHES:
            continue
        smooth = contrasts(pattern, 5)
        left = np.einsum("cp,bpx->bcx", smooth, values[alike])
        usual = np.maximum(_NORMAL_BY_MAD * np.median(np.abs(left), axis=0), 1e-12)
        own = rows[(patterns == pattern).all(axis=1)]
        scaled = np.einsum("cp,bpx->bcx", smooth, values[own]) / usual
        strain = np.mean(scaled**2, axis=(1, 2))
        for place in range(1, _TOGETHER - 2):  # two frames at least to each side of the step
            np.minimum.at(least, own[:, place], strain)
            np.maximum.at(most, own[:, place], strain)
    return set(np.flatnonzero(is_strained(least, most)).tolist())


def is_strained(least: Array, most: Array) -> NDArray[np.bool_]:
    """Steps by the least and the most that stretches over them leave, (n,).

    Source:
        Press et al. 2007, Numerical Recipes, sec. 15.1: mean squares in their usual size.
    """
    return (most > STRAINED) & (least > AROUND) & np.isfinite(least)
