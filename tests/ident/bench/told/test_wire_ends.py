"""How far the wires' ends may be off, in a bench's deviations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.ident.bench.assemble import EFFECTS, assembled
from freeswing.ident.bench.fit_rounds import Solved
from freeswing.ident.bench.runs import Bench, BenchRun, Signal
from freeswing.ident.bench.swing import IZZ
from freeswing.ident.bench.told.budget import WIRE_ENDS, sources
from freeswing.ident.bench.told.wire_ends import with_ends_counted
from freeswing.ident.likelihood.cable_ends import GeometryPriors
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_blocks import Dense
from tests.ident.bench.test_swing_slopes import small_bench, trifilar

RADIUS_M, WIRES = 0.25, 3


def twisted(scaled: bool = True) -> Solved:
    """One run of yaw, of which Izz alone is unknown; or of a channel alone."""
    chi = 0.1 * np.cos(5.0 * np.linspace(0.0, 2.0, 60))
    signal = Signal("chi", chi) if scaled else Signal("dot_px", 900.0 * chi)
    run = BenchRun("a", "identify", np.linspace(0.0, 2.0, 60), (signal,), np.full(WIRES, 1.2))
    bench = Bench((run,), () if scaled else small_bench().channels)
    start = assembled(build_model(trifilar(), EFFECTS), bench, bench.runs)
    unknowns = start.unknowns
    for block in unknowns.shared:
        only = np.arange(block.size) == (IZZ if block.name == "platform" else -1)
        unknowns = unknowns.exchanged(replace(block, estimated=only))
    found = fit(start.swings, unknowns, Dense(steps=5))
    return Solved(found, start.swings, unknowns, 0.0, None)


def test_izz_goes_with_the_radius_of_either_end() -> None:
    """Each of three ends by itself: 0.5 mm are 0.12 % of the mean radius, and of Izz.

    That the rest yaw turns with them, too, adds a tenth in a run of one swing and a half.
    """
    solved = twisted()
    before = solved.solution.std("platform")[IZZ]
    izz = solved.solution.value("platform")[IZZ]
    share = 5e-4 / RADIUS_M / np.sqrt(WIRES)
    for stated, times in (((5e-4, None), 1.0), ((None, 5e-4), 1.0), ((5e-4, 5e-4), np.sqrt(2.0))):
        told = with_ends_counted(solved, trifilar(), GeometryPriors(*stated))
        added = np.sqrt(told.solution.std("platform")[IZZ] ** 2 - before**2)
        assert added / izz == pytest.approx(times * share, rel=0.2), stated
        assert len(sources(told)[WIRE_ENDS]) == sum(one is not None for one in stated) * 9
        np.testing.assert_array_equal(
            told.solution.value("platform"), solved.solution.value("platform")
        )


def test_nothing_said_or_no_scale_changes_nothing() -> None:
    solved = twisted()
    assert with_ends_counted(solved, trifilar(), GeometryPriors()) is solved
    unscaled = twisted(scaled=False)
    assert with_ends_counted(unscaled, trifilar(), GeometryPriors(5e-4)) is unscaled
