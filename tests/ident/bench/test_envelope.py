"""Amplitude against time on benches: which law it follows, and from which column it is read."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.ident.bench.assemble import EFFECTS, assembled
from freeswing.ident.bench.channels import Channel
from freeswing.ident.bench.runs import Bench, BenchRun, Signal
from freeswing.ident.bench.told.envelope import LAWS, envelope, envelopes, law_chances
from tests.ident.bench.test_swing_slopes import trifilar

PERIOD_S = 1.3


def swung(law: str, seed: int, span_s: float = 40.0) -> tuple[np.ndarray, np.ndarray]:
    """Yaw that loses 2 % of its first amplitude a second by a law, with 0.5 mrad of noise."""
    times = np.arange(0.0, span_s, 0.02)
    wave = np.cos(2.0 * np.pi * times / PERIOD_S + seed)
    noise = np.random.default_rng(seed).normal(0.0, 5e-4, len(times))
    return times + 100.0, LAWS[law](0.15, 0.02, times) * wave + noise


@pytest.mark.parametrize("law", ["linear", "quadratic", "dry"])
def test_a_run_that_loses_half_tells_its_law(law: str) -> None:
    found = [envelope(f"run {k}", *swung(law, k)) for k in range(3)]
    runs = [one for one in found if one is not None]
    assert len(runs) == 3
    chances = law_chances(runs)
    assert chances[law] > 0.999, chances
    true = LAWS[law](0.15, 0.02, runs[0].times_s)
    off = (runs[0].measured_rad - true) / runs[0].std_rad
    assert np.abs(off).max() < 4.0, off


def test_a_short_run_tells_no_law() -> None:
    one = envelope("short", *swung("dry", 0, 5.0))
    assert one is not None
    assert max(law_chances([one]).values()) < 0.8, law_chances([one])
    assert envelope("two periods", *swung("dry", 0, 2.9 * PERIOD_S)) is None
    assert law_chances([]) == {}


def test_a_yaw_that_is_not_a_sine_is_not_too_sure() -> None:
    """A beat that no law has: its deviations are enlarged until the best law explains it."""
    times, yaw = swung("linear", 1)
    beating = envelope("a", times, yaw * (1.0 + 0.03 * np.sin(2.0 * np.pi * times / 9.0)))
    assert beating is not None
    assert max(law_chances([beating]).values()) < 0.99, law_chances([beating])


@pytest.mark.parametrize("gain", [900.0, -900.0])
def test_a_curved_channel_is_read_as_yaw(gain: float) -> None:
    """What a dot says of yaw through its own curved map, whatever its sign."""
    times = np.linspace(0.0, 8.0, 240)
    chi = 0.1 * np.exp(-0.02 * times) * np.cos(5.0 * times)
    runs = (
        BenchRun("chi", "identify", times, (Signal("chi", chi),), np.full(3, 1.2)),
        BenchRun(
            "dot", "identify", times, (Signal("dot_px", gain * (chi + chi**2)),), np.full(3, 1.2)
        ),
    )
    bench = Bench(runs, (Channel("dot", "dot_px", ("chi",), order=2),), (), None)
    start = assembled(build_model(trifilar(), EFFECTS), bench, bench.runs)
    told = {"channel.dot": gain * np.ones(2), "offset.dot": np.zeros((2, 1))}
    told["start"] = start.unknowns.block("start").value[[0, 0]]
    unknowns = start.unknowns.moved(told)
    residuals = []
    for index, swing in enumerate(start.swings):
        values = unknowns.of_run(index)
        residuals.append(swing.residuals(values, swing.simulated(values)))
    solved: Any = SimpleNamespace(
        swings=start.swings, solution=SimpleNamespace(unknowns=unknowns, residuals=residuals)
    )
    by_angle, by_dot = envelopes(solved)
    np.testing.assert_allclose(by_dot.measured_rad, by_angle.measured_rad, rtol=0.02)
    folding = replace(solved.swings[1].columns[0], channel=Channel("dot", "dot_px", ("x",), 2))
    folded = replace(solved.swings[1], columns=(folding,))
    bent: Any = SimpleNamespace(swings=(start.swings[0], folded), solution=solved.solution)
    assert [one.run for one in envelopes(bent)] == ["chi"]
