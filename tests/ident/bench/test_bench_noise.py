"""Scatter between runs, colour and what counts as told: decided on made-up solutions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from freeswing.ident.bench.averaged import averaged
from freeswing.ident.bench.mass_verdict import without_prior
from freeswing.ident.bench.runs import BenchRun, Signal
from freeswing.ident.bench.scatter_between_runs import scatter_std
from freeswing.ident.bench.told.classic_formula import BESIDE, ClassicRun, leaning_sentence
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown, Unknowns

WIDE = 0.01


@dataclass
class Found:
    """Each run's Izz seen for itself with a deviation of 1e-4."""

    values: np.ndarray

    @property
    def unknowns(self) -> Unknowns:
        prior = Gaussian(np.zeros(len(self.values)), np.full(len(self.values), WIDE), "test")
        return Unknowns((Unknown("scatter", self.values, np.array([1e-4]), prior),))

    def value(self, name: str) -> np.ndarray:
        assert name == "scatter"
        return self.values

    def covariance_of(self, name: str) -> np.ndarray:
        assert name == "scatter"
        return np.eye(len(self.values)) * 1e-8


@pytest.mark.parametrize(("size", "seen"), [(1.0, False), (1.6, True), (5.0, True)])
def test_scatter_is_seen_where_runs_differ_by_more_than_their_noise(
    size: float, seen: bool
) -> None:
    """Twelve runs that spread by `size` of their own deviations, exactly."""
    pattern = np.tile([1.0, -1.0], 6)
    found = scatter_std(Found(1e-4 * size * pattern))  # type: ignore[arg-type]
    assert (found > 0.0) == seen, found
    if seen:
        expected = 1e-4 * np.sqrt(size**2 - 1.0)
        assert found == pytest.approx(expected, rel=0.15), (found, expected)


def test_a_mass_prior_is_taken_out_again() -> None:
    prior = Gaussian(np.array([1.0]), np.array([0.02]), "weighed")
    alone, alone_std = 1.1, 0.01
    std = (1.0 / 0.01**2 + 1.0 / 0.02**2) ** -0.5
    value = std**2 * (alone / 0.01**2 + 1.0 / 0.02**2)
    mean, spread = without_prior(value, std, prior, 0.02)
    assert mean == pytest.approx(alone)
    assert spread == pytest.approx(alone_std)


@pytest.mark.parametrize(("rate_hz", "kept"), [(79.0, 1), (81.0, 2), (240.0, 6)])
def test_dense_samples_are_averaged_and_others_left(rate_hz: float, kept: int) -> None:
    times = np.arange(481) / rate_hz
    values = np.sin(5.0 * times)
    run = averaged(BenchRun("run", "identify", times, (Signal("chi", values),)))
    assert len(run.times_s) == 481 // kept
    np.testing.assert_allclose(run.signals[0].values, np.sin(5.0 * run.times_s), atol=2e-3)


@pytest.mark.parametrize(
    ("share", "sway_seen", "warned"), [(0.9, False, False), (1.1, False, True), (5.0, True, False)]
)
def test_an_izz_that_leans_on_unseen_sway_is_not_to_be_relied_on(
    share: float, sway_seen: bool, warned: bool
) -> None:
    runs = [ClassicRun(str(k), 1.0, 0.01, 0.01, ((BESIDE, -share),)) for k in range(3)]
    assert ("DO NOT RELY" in leaning_sentence(runs, sway_seen)) == warned
