"""How far up motion is let through, and when a fit is astray: both sides of each limit."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.ident.judge import prediction
from freeswing.ident.signals.band import best_pass_hz

PERIOD_S = 0.01


def samples(n: int, hz: float, motion: float) -> np.ndarray:
    times = PERIOD_S * np.arange(n)
    noise = 1e-4 * np.random.default_rng(2).standard_normal(n)
    return (motion * np.sin(2.0 * np.pi * hz * times) + noise)[:, None]


def test_an_eighth_of_the_sampling_rate_is_the_most() -> None:
    """Of motion at 11.5 and at 14 Hz only the lower one is let through at 100 samples a second."""
    both = samples(2000, 11.5, 1.0) + samples(2000, 14.0, 1.0)
    assert 11.0 < best_pass_hz(both, PERIOD_S, np.ones(1)) < 13.0


def test_a_platforms_swings_are_below_five_hertz() -> None:
    """Noise alone: that much is let through all the same."""
    assert 4.5 < best_pass_hz(samples(2000, 1.0, 0.0), PERIOD_S, np.ones(1)) < 5.6


@pytest.mark.parametrize(("n", "looked"), [(60, False), (68, True)])
def test_a_spectrum_needs_samples(n, looked) -> None:
    assert (best_pass_hz(samples(n, 10.0, 1.0), PERIOD_S, np.ones(1)) > 5.5) == looked


@pytest.mark.parametrize(("share", "astray"), [(0.046, False), (0.054, True)])
def test_a_fit_that_misses_a_twentieth_of_the_motion_is_astray(monkeypatch, share, astray) -> None:
    values = np.tile([1.0, -1.0], 50)[:, None]
    monkeypatch.setattr(prediction, "_error", lambda found: share)
    found = SimpleNamespace(samples=[SimpleNamespace(values=values)])
    assert prediction._is_astray(found) == astray  # pyright: ignore[reportArgumentType]
