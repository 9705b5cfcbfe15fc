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


def pulse_and_line(power_at, line: float) -> np.ndarray:
    """A pulse in the middle whose spectrum is exactly this, and a swing of so much power there.

    The pulse is even about the window's middle and the swing odd: their powers add.
    """
    n = 4001
    frequencies = np.fft.rfftfreq(n, PERIOD_S)
    middle = n // 2
    pulse = np.roll(np.fft.irfft(np.sqrt(power_at(frequencies)), n), middle)
    window = np.blackman(n)
    odd = np.sin(2.0 * np.pi * LINE_HZ * PERIOD_S * (np.arange(n) - middle))
    amplitude = np.sqrt(line / np.sum(np.abs(np.fft.rfft(odd * window)) ** 2))
    return (pulse + amplitude * odd)[:, None]


LINE_HZ = 10.0
FLOOR = 1.0 / np.log(2.0)  # what a spectrum of one everywhere is taken for


def reached(power_at, price: float) -> bool:
    """Whether a line is let through that is worth so many times the noise's floor below it."""
    frequencies = np.fft.rfftfreq(4001, PERIOD_S)
    below = frequencies[(frequencies > 5.0) & (frequencies <= LINE_HZ)]
    line = price * FLOOR * np.sum((below / LINE_HZ) ** 4)
    return best_pass_hz(pulse_and_line(power_at, line), PERIOD_S, np.ones(1)) > 9.5


@pytest.mark.parametrize(("price", "let_through"), [(9.3, False), (10.7, True)])
def test_noise_counts_ten_times_what_motion_does(price, let_through) -> None:
    assert reached(np.ones_like, price) == let_through


@pytest.mark.parametrize(("share", "floor_is_low"), [(0.785, False), (0.815, True)])
def test_the_noise_is_the_median_above_six_tenths_of_nyquist(share, floor_is_low) -> None:
    """The middle of what lies above is at eight tenths: from there on it is noisy."""
    noisy = lambda hz: np.where(hz > share * 0.5 / PERIOD_S, 9.0, 1.0)  # noqa: E731
    assert reached(noisy, 30.0) == floor_is_low


@pytest.mark.parametrize(("over", "is_motion"), [(1.88, False), (2.12, True)])
def test_twice_the_floor_is_motion(over, is_motion) -> None:
    """Then what lies below the line is worth letting through too, and the line need be less."""
    raised = lambda hz: np.where(hz < 12.0, over * FLOOR, 1.0)  # noqa: E731
    assert reached(raised, 9.45) == is_motion


def test_predictions_are_compared_fifty_times_a_second(monkeypatch) -> None:
    """Of a thousand samples a second every twentieth."""
    monkeypatch.setattr(prediction, "replace", lambda _, **changes: SimpleNamespace(**changes))
    times = np.arange(1000) / 1000.0
    run = SimpleNamespace(times_s=times, values=times, whitener=times)
    thinned = prediction._thinned(run)  # pyright: ignore[reportArgumentType]
    assert 48 <= len(thinned.times_s) <= 52
    assert thinned.span_s == (0.0, float(thinned.times_s[-1]))
