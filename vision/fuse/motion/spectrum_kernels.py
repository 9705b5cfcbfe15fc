"""Covariances of a motion of known frequencies, compiled: their inverses, rows and shares of bands.

All are sums of cosines of the time between two poses under one envelope, and a constant:

    k(t) = exp(-(w t)^2 / 2) sum_m P_m cos(omega_m t) + c

Cosines of a difference are made of those of both times. Arrays are filled number by number: slices
bring the text of an error about shapes into what is compiled.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel
from freeswing.cdpr.elimination import inverse_factor

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


class Waves(NamedTuple):
    """What a motion is made of.

    Attributes:
        rates: of the waves, rad/s, (m,).
        power: their variances, (m,).
        width: of the envelope, rad/s.
        constant: variance that all times share.
        noise: variance of poses about the motion.
    """

    rates: Array
    power: Array
    width: float
    constant: float
    noise: float


class Patterns(NamedTuple):
    """Stretches of poses; many have the same times from their middles.

    Attributes:
        times_s: of each pattern, (p, n).
        known: which poses are, (p, n).
        of: each stretch's pattern, (g,).
    """

    times_s: Array
    known: Mask
    of: Ints


class Told(NamedTuple):
    """What stretches of poses say of their bands.

    Attributes:
        traces: of the inverse covariance with each band's shape, all stretches together, (b,).
        squares: of the pulled steps with each band's shape, by coordinate, (k, b).
    """

    traces: Array
    squares: Array


class Rows(NamedTuple):
    """The most likely motion at some times, and what is not known of it.

    Attributes:
        before: at the instants, (n, k).
        after: so long after, (n, k).
        rates: there, (n, k).
        bends: there, (n, k).
        open: variance of after less before, (n,).
    """

    before: Array
    after: Array
    rates: Array
    bends: Array
    open: Array


@kernel
def _turning(times_s: Array, rates: Array) -> tuple[Array, Array]:
    """Cosines and sines of all waves at some times, (m, n) each."""
    cosines, sines = np.empty((len(rates), len(times_s))), np.empty((len(rates), len(times_s)))
    for m in range(len(rates)):
        for i in range(len(times_s)):
            cosines[m, i] = math.cos(rates[m] * times_s[i])
            sines[m, i] = math.sin(rates[m] * times_s[i])
    return cosines, sines


@kernel
def _shapes(times_s: Array, waves: Waves) -> Array:
    """Cosines of the time between each two of some times, under the envelope, (m, pairs).

    Pairs are those of a lower triangle, row by row.
    """
    n = len(times_s)
    cosines, sines = _turning(times_s, waves.rates)
    shapes = np.empty((len(waves.rates), n * (n + 1) // 2))
    envelope = np.empty(n)
    at = 0
    for i in range(n):
        for j in range(i + 1):
            apart = waves.width * (times_s[i] - times_s[j])
            envelope[j] = math.exp(-0.5 * apart * apart)
        for m in range(len(waves.rates)):
            c, s = cosines[m, i], sines[m, i]
            for j in range(i + 1):
                shapes[m, at + j] = envelope[j] * (c * cosines[m, j] + s * sines[m, j])
        at += i + 1
    return shapes


@kernel
def _inverse(shapes: Array, known: Mask, waves: Waves) -> Array:
    """Of the covariance of known poses with their noise, zero where not known, (n, n)."""
    n = len(known)
    plain = np.dot(waves.power, shapes)
    whole, at = np.zeros((n, n)), 0
    for i in range(n):
        for j in range(i + 1):
            if known[i] and known[j]:
                whole[i, j] = plain[at + j] + waves.constant
        whole[i, i] += waves.noise if known[i] else 1.0
        at += i + 1
    factor = inverse_factor(whole)
    inverse = np.zeros((n, n))
    for k in range(n):
        if known[k]:
            for i in range(k + 1):
                for j in range(i + 1):
                    inverse[i, j] += factor[k, i] * factor[k, j]
    for i in range(n):
        for j in range(i):
            inverse[j, i] = inverse[i, j]
    return inverse


@kernel
def inverse_covariances(patterns: Patterns, waves: Waves) -> Array:
    """Of the poses of each pattern with their noise, zero where not known, (p, n, n).

    Source:
        Rasmussen, Williams 2006, Gaussian Processes for Machine Learning, sec. 2.2.
    """
    count, n = patterns.times_s.shape
    found = np.empty((count, n, n))
    for p in range(count):
        own = _inverse(_shapes(patterns.times_s[p], waves), patterns.known[p], waves)
        for i in range(n):
            for j in range(n):
                found[p, i, j] = own[i, j]
    return found


@kernel
def told_by_stretches(patterns: Patterns, steps: Array, waves: Waves) -> Told:
    """What the steps (g, n, k) of some stretches say of each wave.

    Source:
        Foerstner, Wrobel 2016, Photogrammetric Computer Vision, sec. 4.2.4: components of
        variance.
    """
    size = steps.shape[2]
    told = Told(np.zeros(len(waves.rates)), np.zeros((size, len(waves.rates))))
    for p in range(len(patterns.known)):
        shapes = _shapes(patterns.times_s[p], waves)
        inverse = _inverse(shapes, patterns.known[p], waves)
        squares = np.zeros((size + 1, shapes.shape[1]))
        for g in range(len(patterns.of)):
            if patterns.of[g] == p:
                _add_pairs(inverse, np.dot(inverse, steps[g]), squares)
        by_wave = np.dot(squares, shapes.T)
        for m in range(len(waves.rates)):
            told.traces[m] += by_wave[size, m]
            for k in range(size):
                told.squares[k, m] += by_wave[k, m]
    return told


@kernel
def _add_pairs(inverse: Array, pulled: Array, squares: Array) -> None:
    """Adds products of a stretch's pulled steps (n, k), and the inverse, to (k + 1, pairs)."""
    n, size = pulled.shape
    at = 0
    for i in range(n):
        for j in range(i + 1):
            twice = 1.0 if i == j else 2.0
            for k in range(size):
                squares[k, at] += twice * pulled[i, k] * pulled[j, k]
            squares[size, at] += twice * inverse[i, j]
            at += 1


@kernel
def motion_rows(
    patterns: Patterns,
    inverses: Array,
    steps: Array,
    waves: Waves,
    group_of: Ints,
    at_s: Array,
    lags_s: Array,
) -> Rows:
    """The most likely motion through stretches of poses, at times from their middles and later.

    Args:
        patterns: the stretches.
        inverses: covariances' inverses of their patterns, (p, w, w).
        steps: of the poses from one near the middle, (g, w, k).
        waves: what the motion is made of.
        group_of: stretch of each row, increasing, (n,).
        at_s: (n,).
        lags_s: how much later, (n,).

    Source:
        Rasmussen, Williams 2006, Gaussian Processes for Machine Learning, sec. 2.2 and 9.4:
        prediction of values and slopes.
    """
    n, size = len(at_s), steps.shape[2]
    rows = Rows(
        np.zeros((n, size)), np.zeros((n, size)), np.zeros((n, size)), np.zeros((n, size)),
        np.zeros(n),
    )  # fmt: skip
    at_home = np.ones((len(waves.rates), 1)), np.zeros((len(waves.rates), 1))
    home = np.zeros(1)
    whole = _covariances(0.0, home, at_home, waves)[0, 0]
    group, weights = -1, np.zeros((steps.shape[1], size))
    turning = at_home
    for row in range(n):
        p = patterns.of[group_of[row]]
        times = patterns.times_s[p]
        if group_of[row] != group:
            group = group_of[row]
            turning = _turning(times, waves.rates)
            weights = np.dot(inverses[p], steps[group])
        here = _covariances(at_s[row], times, turning, waves)
        there = here
        if lags_s[row] != 0.0:
            there = _covariances(at_s[row] + lags_s[row], times, turning, waves)
            apart = there[0] - here[0]
            own = _covariances(lags_s[row], home, at_home, waves)[0, 0]
            rows.open[row] = 2.0 * (whole - own) - np.dot(apart, np.dot(inverses[p], apart))
        here, there = np.dot(here, weights), np.dot(there, weights)
        for k in range(size):
            rows.before[row, k], rows.after[row, k] = here[0, k], there[0, k]
            rows.rates[row, k], rows.bends[row, k] = there[1, k], there[2, k]
    return rows


@kernel
def _covariances(
    time_s: float, others_s: Array, turning: tuple[Array, Array], waves: Waves
) -> Array:
    """With some times whose cosines and sines are known, and their two slopes, (3, n)."""
    cosines, sines = turning
    found = np.zeros((3, len(others_s)))
    plain, first, second = found
    for m in range(len(waves.rates)):
        rate = waves.rates[m]
        c = waves.power[m] * math.cos(rate * time_s)
        s = waves.power[m] * math.sin(rate * time_s)
        for j in range(len(others_s)):
            along = c * cosines[m, j] + s * sines[m, j]
            plain[j] += along
            first[j] += rate * (c * sines[m, j] - s * cosines[m, j])
            second[j] -= rate * rate * along
    w2 = waves.width * waves.width
    for j in range(len(others_s)):
        apart = time_s - others_s[j]
        fall = -w2 * apart
        envelope = math.exp(-0.5 * w2 * apart * apart)
        second[j] = envelope * (second[j] + 2.0 * fall * first[j] + (fall * fall - w2) * plain[j])
        first[j] = envelope * (first[j] + fall * plain[j])
        plain[j] = envelope * plain[j] + waves.constant
    return found
