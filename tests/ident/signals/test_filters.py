"""The smoother: exact on polynomials, one stamp, silent in the stop band; the authors' lag."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.ident.signals.filters import forward_difference_smoother, smoother


@pytest.mark.parametrize("degree", range(5))
def test_polynomials_to_the_fourth_degree_pass_exactly(degree: int):
    s = smoother(0.01)
    reach = 0.01 * np.arange(-s.half, s.half + 1)
    exact = [float(degree == d) * [1.0, 1.0, 2.0][d] for d in range(3)]
    got = s.kernels @ reach**degree
    assert np.allclose(got, exact, atol=1e-8), f"t^{degree}: {got}, expected {exact}"


def test_kernels_are_symmetric_so_that_nothing_lags():
    s = smoother(0.01)
    parity = [1.0, -1.0, 1.0] * s.kernels.T
    off = np.abs(s.kernels.T[::-1] - parity).max()
    assert off < 1e-9, f"largest asymmetry {off}"


def test_pass_band_is_flat_and_stop_band_silent():
    s = smoother(0.01, 5.0, 10.0)
    in_band = np.abs(s.response(np.linspace(0.1, 4.5, 50)) - 1.0).max()
    frequencies = np.linspace(10.5, 49.0, 200)
    out = np.abs(s.response(frequencies)).max()
    assert in_band < 3e-3, f"pass band off by {in_band}"
    assert out < 3e-3, f"stop band lets {out} through"


def test_value_and_derivatives_let_the_same_share_of_each_frequency_through():
    """So a linear law between position and acceleration survives, transition band included."""
    gain = smoother(0.01, 5.0, 10.0).response(np.linspace(0.5, 12.0, 60))
    spread = np.abs(gain - gain[:1]).max()
    assert spread < 1e-3, f"gains differ by {spread}"


def test_the_authors_velocity_lags_half_a_sample_and_the_acceleration_one():
    period = 0.01
    s = forward_difference_smoother(period)
    reach = period * np.arange(-s.half, s.half + 1)
    # Of t^2 the rate is 2 t: a rate read half a sample later is 2 (t + T / 2).
    lag = s.kernels[1] @ reach**2 / 2.0
    second_lag = s.kernels[2] @ reach**3 / 6.0
    assert lag == pytest.approx(0.5 * period, rel=1e-6), f"velocity lag {lag}"
    assert second_lag == pytest.approx(period, rel=1e-6), f"acceleration lag {second_lag}"


@pytest.mark.parametrize(
    ("pass_hz", "stop_hz", "sentence"),
    [(0.0, 10.0, "pass_hz"), (10.0, 5.0, "pass_hz"), (60.0, 70.0, "record at 240 Hz or faster")],
)
def test_impossible_bands_are_refused(pass_hz: float, stop_hz: float, sentence: str):
    with pytest.raises(ValueError, match=sentence):
        smoother(0.01, pass_hz, stop_hz)
