"""Samples to signals: derivatives, noise, gaps, jumps, decimation, windows, reasons to drop."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.rotation import angle_rate_matrix
from freeswing.ident.runs import SwingRun
from freeswing.ident.signals.derivatives import SignalSettings, UnusableRunError, signals_of
from freeswing.ident.signals.regular_grid import (
    bridged,
    bridges,
    incomplete,
    jump_sizes,
    regular_grid,
    white_noise_std,
)

PUBLISHED = SignalSettings(pass_hz=5.0, stop_hz=10.0)
EVERY = SignalSettings(pass_hz=5.0, stop_hz=10.0, output_hz=0.0)


def wave(times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two sums of swings with their exact derivatives, (n, 2) each."""
    found = []
    for order in range(3):
        columns = [
            sum(
                a * (2 * np.pi * f) ** order * np.cos(2 * np.pi * f * times + p + order * np.pi / 2)
                for a, f, p in parts
            )
            for parts in ([(0.03, 1.1, 0.2), (0.01, 2.3, 1.0)], [(0.02, 1.7, 0.7)])
        ]
        found.append(np.stack(columns, axis=1))
    return found[0], found[1], found[2]


def run_of(times, values, window=(0.0, 10.0), covariances=None, coordinates=("x", "y")):
    trajectory = Trajectory(times, coordinates, values, covariances, "made")
    return SwingRun("r", "identify", trajectory, window_s=window)


def test_derivatives_share_the_position_s_time_stamp():
    times = np.arange(1001) / 100.0
    s = signals_of(run_of(times, wave(times)[0]), PUBLISHED)
    for name, got, exact in zip(
        ("value", "velocity", "acceleration"),
        (s.values, s.velocities, s.accelerations),
        wave(s.times_s),
        strict=True,
    ):
        error = np.abs(got - exact).max() / np.abs(exact).max()
        assert error < 1e-3, f"{name} off by {error}"


def test_decimation_and_edges():
    times = np.arange(1001) / 100.0
    s = signals_of(run_of(times, wave(times)[0], (1.0, 9.0)), PUBLISHED)
    edge = PUBLISHED.kernels(0.01).half * 0.01
    assert np.allclose(np.diff(s.times_s), 0.1), f"steps {np.unique(np.diff(s.times_s))}"
    assert s.times_s[0] >= 1.0 + edge - 1e-9, f"first {s.times_s[0]}, edge {edge}"
    assert s.times_s[-1] <= 9.0 - edge + 1e-9, f"last {s.times_s[-1]}, edge {edge}"


def test_noise_is_propagated():
    """Monte Carlo: the stated covariance of value, velocity and acceleration is the real one."""
    times = np.arange(401) / 100.0
    generator = np.random.default_rng(3)
    noise = np.array([[4e-8, 1e-8], [1e-8, 2e-8]])
    covariances = np.broadcast_to(noise, (len(times), 2, 2))
    missing = [150, 151, 152]
    errors = []
    for _ in range(400):
        samples = generator.multivariate_normal([0.0, 0.0], noise, len(times))
        samples[missing] = np.nan
        samples += wave(times)[0]
        s = signals_of(run_of(times, samples, (0.0, 4.0), covariances), EVERY)
        exact = np.concatenate(wave(s.times_s), axis=1)
        got = np.concatenate([s.values, s.velocities, s.accelerations], axis=1)
        errors.append((got - exact)[[20, 113]])
    seen = np.std(np.array(errors), axis=0)
    stated = np.sqrt(s.covariances[[20, 113]].diagonal(axis1=1, axis2=2))
    ratio = seen / stated
    assert ((ratio > 0.88) & (ratio < 1.12)).all(), f"seen over stated {ratio}"


def test_rotation_covariances_become_those_of_the_angles():
    times = np.arange(401) / 100.0
    values = np.zeros((401, 6))
    values[:, :2] = wave(times)[0]
    values[:, 3:] = [0.3, 0.5, -0.2]
    rotation = np.diag([1e-6, 4e-6, 9e-6])
    covariances = np.zeros((401, 6, 6))
    covariances[:, :3, :3] = 1e-8 * np.eye(3)
    covariances[:, 3:, 3:] = rotation
    names = ("x", "y", "z", "phi", "theta", "chi")
    s = signals_of(run_of(times, values, (0.0, 4.0), covariances, names), PUBLISHED)
    back = np.linalg.inv(angle_rate_matrix(values[0, 3:]))
    expected = np.sqrt(np.diag(back @ rotation @ back.T))
    assert np.allclose(s.noise_std[3:], expected, rtol=1e-6), f"{s.noise_std[3:]} {expected}"


def test_short_gaps_are_bridged_and_long_ones_are_not():
    times = np.arange(1001) / 100.0
    values = wave(times)[0].copy()
    values[300:305] = np.nan
    values[600:606] = np.nan
    s = signals_of(run_of(times, values), EVERY)
    half = EVERY.kernels(0.01).half
    near_short = np.abs(s.times_s - 3.02) < 0.01
    near_long = (s.times_s > 6.0 - 0.01 * half) & (s.times_s < 6.05 + 0.01 * half)
    error = np.abs(s.values - wave(s.times_s)[0]).max()
    assert near_short.any(), "the short gap was not bridged"
    assert not near_long.any(), f"smoothed across the long gap at {s.times_s[near_long]}"
    assert error < 5e-5, f"largest error {error} m"


def test_dropped_frames_and_jitter_are_put_on_the_grid():
    generator = np.random.default_rng(0)
    times = np.arange(501) / 100.0
    kept = generator.uniform(size=501) > 0.02
    jittered = times + 0.0008 * generator.uniform(-1.0, 1.0, 501)
    grid = regular_grid(jittered[kept], wave(jittered[kept])[0])
    known = ~incomplete(grid.values)
    error = np.abs(grid.values[known] - wave(grid.times_s[known])[0]).max()
    assert known.sum() == kept.sum(), f"{known.sum()} placed of {kept.sum()}"
    assert error < 3e-5, f"largest error {error} m"
    assert grid.jitter_s > 0.0005, f"jitter {grid.jitter_s} s"


def test_a_jump_is_not_smoothed_across():
    times = np.arange(1001) / 100.0
    values = wave(times)[0].copy()
    values[500:, 0] += 0.01
    s = signals_of(run_of(times, values), EVERY)
    reach = 0.01 * EVERY.kernels(0.01).half
    across = np.abs(s.times_s - 4.995) < reach - 0.01
    assert s.jumps == 1, f"{s.jumps} jumps found"
    assert not across.any(), f"smoothed across at {s.times_s[across]}"


def test_jump_sizes_measure_the_step():
    values = np.concatenate([np.zeros(50), np.full(50, 0.02)])[:, None]
    sizes, _ = jump_sizes(values)
    assert sizes[50, 0] == pytest.approx(0.02, abs=1e-12), f"{sizes[50, 0]}"


def test_bridges_are_exact_on_cubics():
    x = np.arange(40.0)
    values = (1.0 + x - 0.1 * x**2 + 0.01 * x**3)[:, None]
    holes = values.copy()
    holes[18:22] = np.nan
    filled = bridged(holes, bridges(incomplete(holes), 5))
    error = np.abs(filled - values).max()
    assert error < 1e-8, f"bridge off by {error}"


def test_white_noise_is_estimated_under_a_swing():
    generator = np.random.default_rng(5)
    times = np.arange(1001) / 100.0
    std = white_noise_std(wave(times)[0] + 1e-4 * generator.standard_normal((1001, 2)))
    assert (np.abs(std / 1e-4 - 1.0) < 0.1).all(), f"estimated {std}"


def test_mostly_missing_is_dropped_with_its_number():
    times = np.arange(1001) / 100.0
    values = wave(times)[0].copy()
    values[200:900] = np.nan
    with pytest.raises(UnusableRunError, match="70 % of its samples are missing"):
        signals_of(run_of(times, values), PUBLISHED)


def test_a_window_outside_the_recording_is_dropped_with_its_span():
    times = np.arange(1001) / 100.0
    with pytest.raises(UnusableRunError, match="no sample in its window"):
        signals_of(run_of(times, wave(times)[0], (20.0, 30.0)), PUBLISHED)


def test_selection_keeps_the_right_covariances():
    times = np.arange(401) / 100.0
    noise = np.diag([1e-8, 9e-8])
    covariances = np.broadcast_to(noise, (401, 2, 2))
    s = signals_of(run_of(times, wave(times)[0], (0.0, 4.0), covariances), PUBLISHED)
    only = s.select(("y",))
    assert only.covariances.shape[1:] == (3, 3), f"{only.covariances.shape}"
    ratio = only.covariances[0, 2, 2] / s.covariances[0, 4, 4]
    assert ratio == pytest.approx(9.0), f"acceleration variance ratio {ratio}"


def test_wide_swings_get_a_wider_pass_band_and_noise_narrows_it():
    generator = np.random.default_rng(1)
    times = np.arange(1001) / 100.0
    harmonic = wave(times)[0] + 1e-3 * np.sin(2 * np.pi * 7.5 * times)[:, None]
    quiet = signals_of(run_of(times, wave(times)[0] + 1e-6 * generator.standard_normal((1001, 2))))
    wide = signals_of(run_of(times, harmonic + 1e-6 * generator.standard_normal((1001, 2))))
    noisy = signals_of(run_of(times, harmonic + 1e-2 * generator.standard_normal((1001, 2))))
    bands = quiet.pass_hz, wide.pass_hz, noisy.pass_hz
    assert bands[0] < 5.5, f"pass bands {bands}"
    assert 7.4 < bands[1] < 9.0, f"pass bands {bands}"
    assert bands[2] < 7.5, f"pass bands {bands}"
