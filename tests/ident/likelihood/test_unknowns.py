"""Named blocks of unknowns and the one fit over them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest

from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_blocks import Dense
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown, Unknowns

RATE, STD = 0.7, 0.01


@dataclass(frozen=True)
class Decay:
    """An amplitude of its own that decays at a rate that all share."""

    name: str
    times: np.ndarray
    values: np.ndarray

    def simulated(self, values: Mapping[str, np.ndarray]) -> None:
        return None

    def residuals(self, values: Mapping[str, np.ndarray], made: None) -> np.ndarray:
        told = values["amplitude"][0] * np.exp(-values["rate"][0] * self.times)
        return (told - self.values) / STD

    def linearised(
        self, values: Mapping[str, np.ndarray], made: None
    ) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        shape = np.exp(-values["rate"][0] * self.times)
        slope = -values["amplitude"][0] * self.times * shape
        by = {"amplitude": shape[:, None] / STD, "rate": slope[:, None] / STD}
        return self.residuals(values, made), by


def decays(noise: float, seed: int = 0) -> list[Decay]:
    generator, times = np.random.default_rng(seed), np.linspace(0.0, 3.0, 40)
    return [
        Decay(f"run {k}", times, a * np.exp(-RATE * times) + generator.normal(0.0, noise, 40))
        for k, a in enumerate((1.0, 2.5, 0.4))
    ]


def start(prior: Gaussian | None = None) -> Unknowns:
    return Unknowns(
        (
            Unknown("rate", np.array([0.2]), np.array([0.1]), prior),
            Unknown("amplitude", np.full((3, 1), 1.0), np.array([0.5]), each_run=True),
        )
    )


def test_shared_and_own_unknowns_are_found_exactly() -> None:
    found = fit(decays(0.0), start(), Dense(tolerance=1e-20))
    assert found.converged, found.reason
    np.testing.assert_allclose(found.value("rate"), RATE, rtol=1e-9)
    np.testing.assert_allclose(found.value("amplitude")[:, 0], [1.0, 2.5, 0.4], rtol=1e-9)


def test_the_deviation_is_that_of_many_repetitions() -> None:
    fits = [fit(decays(STD, seed), start(), Dense()) for seed in range(200)]
    spread = np.std([one.value("rate")[0] for one in fits])
    assert spread == pytest.approx(fits[0].std("rate")[0], rel=0.15), spread


def test_the_covariance_is_that_of_all_unknowns_together() -> None:
    """Elimination run by run gives what one large matrix gives."""
    runs, blocks = decays(STD), start(Gaussian(np.array([0.5]), np.array([0.01]), "a guess"))
    found = fit(runs, blocks, Dense(tolerance=1e-12))
    whole = np.zeros((3 * 40 + 1, 4))
    for k, run in enumerate(runs):
        slopes = run.linearised(found.unknowns.of_run(k), None)[1]
        whole[40 * k : 40 * k + 40, 0] = slopes["rate"][:, 0]
        whole[40 * k : 40 * k + 40, 1 + k] = slopes["amplitude"][:, 0]
    whole[-1, 0] = 1.0 / 0.01
    expected = np.linalg.inv(whole.T @ whole)[0, 0]
    assert found.covariance[0, 0] == pytest.approx(expected, rel=1e-9)


def test_a_held_block_stays_and_one_nothing_depends_on_loses_rank() -> None:
    held = fit(decays(STD), start().held("rate"), Dense())
    assert held.value("rate")[0] == 0.2
    assert held.std("rate")[0] == 0.0
    idle = Unknown("idle", np.zeros(2), np.ones(2))
    lost = fit(decays(STD), start().joined(idle), Dense())
    assert lost.rank == 1, lost.singular_values
    assert np.isinf(lost.std("idle")).all()
    known = start().joined(idle).known("idle", Gaussian(np.ones(2), np.full(2, 3.0), "a guess"))
    found = fit(decays(STD), known, Dense())
    np.testing.assert_allclose(found.value("idle"), 1.0, atol=1e-6)
    np.testing.assert_allclose(found.std("idle"), 3.0, rtol=1e-9)


def test_what_was_known_together_moves_together() -> None:
    """An unknown that no run sees follows another as far as both were known together.

    Conditioning of Gaussians: its mean by the regression on the other, its variance likewise.
    """
    mean, std, rho = np.array([0.4, 2.0]), np.array([0.01, 0.5]), 0.8
    idle = Unknown("idle", np.zeros(1), np.ones(1), Gaussian(mean[1:], std[1:], "a guess"))
    blocks = start(Gaussian(mean[:1], std[:1], "a guess")).joined(idle)
    together = blocks.known_together(("rate", "idle"), np.array([[1.0, rho], [rho, 1.0]]))
    found = fit(decays(STD), together, Dense(tolerance=1e-12))
    slope = rho * std[1] / std[0]
    assert found.value("idle")[0] == pytest.approx(2.0 + slope * (found.value("rate")[0] - 0.4))
    spread = np.hypot(std[1] * np.sqrt(1.0 - rho**2), slope * found.std("rate")[0])
    assert found.std("idle")[0] == pytest.approx(spread, rel=1e-6)
    alone = fit(decays(STD), together.known_together(("rate", "idle"), None), Dense())
    assert alone.value("idle")[0] == pytest.approx(2.0, rel=1e-9)


def test_correlations_follow_their_blocks() -> None:
    """Blocks that come are known by themselves, those that go take what was known with them."""
    a, b, c = (Unknown(name, np.zeros(k), np.ones(k)) for name, k in (("a", 1), ("b", 2), ("c", 1)))
    pair = np.array([[1.0, 0.5], [0.5, 1.0]])
    blocks = Unknowns((a, b)).known_together(("b",), pair)
    more = blocks.joined(c)
    assert more.correlations is not None
    assert more.correlations[3].tolist() == [0.0, 0.0, 0.0, 1.0]
    assert more.correlations[1, 2] == 0.5
    fewer = more.without("a")
    assert fewer.correlations is not None
    assert fewer.correlations[0, 1] == 0.5
    assert fewer.correlations.shape == (3, 3)
    held = fewer.held("b").moved({"c": np.ones(1)})
    assert held.correlations is not None
    assert held.correlations.tolist() == fewer.correlations.tolist()
    with pytest.raises(ValueError, match="of 3 numbers"):
        Unknowns((a, b), pair)


def test_a_bound_holds() -> None:
    blocks = start()
    low = Unknown("rate", np.array([0.9]), np.array([0.1]), low=np.array([0.8]))
    found = fit(decays(0.0), blocks.without("rate").joined(low), Dense())
    assert found.value("rate")[0] == 0.8


def test_blocks_are_asked_for_by_name() -> None:
    blocks = start()
    assert blocks.without("rate").names == ("amplitude",)
    assert "rate" in blocks
    with pytest.raises(ValueError, match=r"no unknown is called 'mass'; there are rate, amplitude"):
        blocks.block("mass")
    with pytest.raises(ValueError, match=r"twice"):
        blocks.joined(blocks.block("rate"))
    with pytest.raises(ValueError, match=r"no run to fit"):
        fit([], blocks, Dense())
    with pytest.raises(ValueError, match=r"amplitude: values of 3 runs for 2"):
        fit(decays(0.0)[:2], blocks, Dense())
