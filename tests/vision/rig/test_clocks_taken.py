"""Clocks below six deviations that are taken all the same: no others make what is taken right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from freeswing.vision.rig import correct_rig as rig
from freeswing.vision.rig.rig_step import Finding
from tests.vision.rig import made_views as made
from tests.vision.rig.made_views import Recorded, made_views

WORSE_PX = 0.1  # corners of squeezed or dark films


def found_of(findings: tuple[Finding, ...], effect: str) -> tuple[float, float]:
    (one,) = [f for f in findings if (f.effect, f.camera) == (effect, "right")]
    return one.parameters[0][1:]


@pytest.mark.parametrize("seed", [5, *(pytest.param(k, marks=pytest.mark.slow) for k in (6, 7, 8))])
def test_a_clock_goes_with_the_line_time(tmp_path, monkeypatch, seed) -> None:
    """2 ms between two rolling shutters, known to 0.35: without it poses were 1.1 claims off.

    A line time that is put in without the clock that it was found with moves the picture's middle.
    """
    monkeypatch.setattr(made, "NOISE_PX", WORSE_PX)
    recorded = Recorded(line_time_s=25e-6), Recorded(line_time_s=-18e-6, late_s=2e-3)
    views, watch = made_views(tmp_path, recorded, seed=seed)
    findings = rig.correct_rig(views, watch, 1e-3).findings
    clock, clock_std = found_of(findings, "clock_offset")
    line, line_std = found_of(findings, "rolling_shutter")
    assert abs(clock - 2e-3) < 3.0 * clock_std < 2e-3, (clock, clock_std)
    assert abs(line + 18e-6) < 3.0 * line_std, (line, line_std)


def test_a_searched_start_keeps_nothing_of_the_search(tmp_path, monkeypatch) -> None:
    """Starts are found to some milliseconds; an adjustment of them by three deviations is one."""
    search = rig.aligned

    def rougher(*given):
        told = search(*given)
        return replace(told, lags_s=told.lags_s + np.where(told.lags_s != 0.0, 2.5e-4, 0.0))

    monkeypatch.setattr(rig, "aligned", rougher)
    monkeypatch.setattr(made, "NOISE_PX", WORSE_PX)
    views, watch = made_views(tmp_path, (Recorded(), Recorded(late_s=0.703)))
    clock, std = found_of(rig.correct_rig(views, watch, 1e-3).findings, "clock_offset")
    assert abs(clock - 0.703) < 3.0 * std < 3e-4, (clock, std)
