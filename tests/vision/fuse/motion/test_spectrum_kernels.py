"""Compiled covariances against their formulas in whole arrays."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.vision.fuse.motion.motion_spectrum import BANDS, Spectrum
from freeswing.vision.fuse.motion.spectrum_kernels import (
    Patterns,
    Waves,
    inverse_covariances,
    motion_rows,
    told_by_stretches,
)

STEP_S, POSES = 0.05, 20


def made(stretches: int = 3) -> tuple[Patterns, Waves, np.ndarray]:
    """Two stretches of one pattern, others of their own with a gap, and their steps."""
    rng = np.random.default_rng(5)
    times = STEP_S * (np.arange(POSES) - 9.0) + 0.002 * rng.standard_normal((2, POSES))
    known = np.ones((2, POSES), dtype=bool)
    known[1, [3, 4, 11]] = False
    of = np.array([0, 1, 0])[:stretches]
    steps = rng.standard_normal((stretches, POSES, 6)) * known[of][..., None]
    return (
        Patterns(times, known, of),
        Spectrum(STEP_S, 9.0 / np.linspace(1.0, BANDS, BANDS), 1.3).waves(),
        steps,
    )


def shapes(apart_s: np.ndarray, waves: Waves) -> np.ndarray:
    """Of each wave, (m, ...)."""
    arms = waves.rates.reshape(-1, *np.ones(apart_s.ndim, int)) * apart_s
    return np.cos(arms) * np.exp(-0.5 * (waves.width * apart_s) ** 2)


def covariance(apart_s: np.ndarray, waves: Waves) -> np.ndarray:
    return np.tensordot(waves.power, shapes(apart_s, waves), 1) + waves.constant


def inverse(patterns: Patterns, waves: Waves, p: int) -> np.ndarray:
    """By LAPACK, of what is known; zero elsewhere."""
    there = np.flatnonzero(patterns.known[p])
    apart = patterns.times_s[p][there, None] - patterns.times_s[p][there]
    whole = np.zeros((POSES, POSES))
    plain = covariance(apart, waves) + waves.noise * np.eye(len(there))
    whole[np.ix_(there, there)] = np.linalg.inv(plain)
    return whole


def test_inverses_are_lapacks_and_know_nothing_where_nothing_is_known() -> None:
    patterns, waves, _ = made()
    for p, found in enumerate(inverse_covariances(patterns, waves)):
        np.testing.assert_allclose(found, inverse(patterns, waves, p), rtol=1e-9, atol=1e-11)


def test_bands_are_told_as_by_whole_arrays() -> None:
    patterns, waves, steps = made()
    told = told_by_stretches(patterns, steps, waves)
    traces, squares = 0.0, 0.0
    for g, p in enumerate(patterns.of):
        own = inverse(patterns, waves, p)
        by_wave = shapes(patterns.times_s[p][:, None] - patterns.times_s[p], waves)
        pulled = own @ steps[g]
        traces = traces + (by_wave * own).sum(axis=(1, 2))
        squares = squares + np.einsum("mij,ik,jk->km", by_wave, pulled, pulled)
    np.testing.assert_allclose(told.traces, traces, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(told.squares, squares, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("lag_s", [0.0, 0.013, -0.024])
def test_motion_and_its_slopes(lag_s: float) -> None:
    patterns, waves, steps = made()
    at, group_of = np.array([-0.03, 0.1, 0.02]), np.array([0, 1, 2])
    own = inverse_covariances(patterns, waves)

    def rows(lags_s: float):
        return motion_rows(patterns, own, steps, waves, group_of, at, np.full(3, lags_s))

    found = rows(lag_s)
    for g, p in enumerate(patterns.of):
        here, there = (covariance(at[g] + lag - patterns.times_s[p], waves) for lag in (0.0, lag_s))
        np.testing.assert_allclose(found.before[g], here @ own[p] @ steps[g], rtol=1e-9)
        np.testing.assert_allclose(found.after[g], there @ own[p] @ steps[g], rtol=1e-9)
        change = 2.0 * (covariance(np.zeros(()), waves) - covariance(np.array(lag_s), waves))
        left = float(change - (there - here) @ own[p] @ (there - here))
        assert found.open[g] == pytest.approx(left, rel=1e-8, abs=1e-12)
    dt = 1e-4
    sooner, later = rows(lag_s - dt), rows(lag_s + dt)
    slopes = (later.after - sooner.after) / (2.0 * dt)
    bends = (later.after - 2.0 * found.after + sooner.after) / dt**2
    np.testing.assert_allclose(found.rates, slopes, atol=1e-5 * np.abs(slopes).max())
    np.testing.assert_allclose(found.bends, bends, atol=1e-4 * np.abs(bends).max())


def test_where_no_time_has_passed_nothing_is_open() -> None:
    """Cameras that see at the instants leave weights as they are, to the last digit."""
    patterns, waves, steps = made()
    own = inverse_covariances(patterns, waves)
    found = motion_rows(patterns, own, steps, waves, np.arange(3), np.full(3, 0.01), np.zeros(3))
    assert (found.open == 0.0).all()
    assert (found.before == found.after).all()
