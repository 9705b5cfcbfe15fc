"""What a calibration does to all poses alike is no effect, however sharply the swings show it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from freeswing.ident.diagnose.decision import excess_of, included
from freeswing.ident.diagnose.heldout import held_out
from freeswing.ident.diagnose.refit import Refit, colour_of, freed, refit, rescored
from freeswing.ident.diagnose.screen import screen
from freeswing.ident.judge.prediction import Stage
from freeswing.ident.likelihood.blocks import first_unknowns
from freeswing.ident.likelihood.calibration_modes import amplitudes_of
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_swings import ONWARD, Swings
from freeswing.ident.likelihood.samples_and_noise import UNIT_NOISE_M
from freeswing.ident.likelihood.session_estimates import begun
from tests.ident.likelihood.test_calibration_modes import NOISE_M, prepared, runs
from tests.ident.swings import TRUE_INERTIA, paper_model

# A base frame turned by 0.3 mrad about x and y: all anchors seem off by tenths of a millimetre.
TURNED = np.array([0.0, 0.0, 0.0, 3.0, 3.0, 0.0, 0.0])
SCALES = np.full(2, NOISE_M / UNIT_NOISE_M)


@cache
def searched(known: bool) -> tuple[Refit, Refit]:
    """The declared model and one with displaced anchors, as the search fits them."""
    ready = prepared(runs(TURNED, seed=6))
    if not known:
        ready = [replace(one, run=replace(one.run, pose_errors=None)) for one in ready]
    model = paper_model()
    _, samples, states, _ = begun(model, ready, None, TRUE_INERTIA)
    unknowns = first_unknowns(model, TRUE_INERTIA, states, [None] * len(samples))
    found = fit(Swings(model, tuple(samples), SCALES), unknowns, ONWARD)
    colour = colour_of(found, SCALES)
    current = freed(rescored(found, SCALES, colour), SCALES)
    return current, refit(current.fit, "anchor_offset", np.zeros(12), SCALES, colour)


def test_anchors_that_a_turned_base_frame_displaces_are_where_they_are() -> None:
    current, moved = searched(known=True)
    assert included(current, moved, "anchor_offset", SCALES) < 0.1
    assert excess_of(current) < 0.1, excess_of(current)


def test_without_the_calibrations_errors_they_are_claimed() -> None:
    """The negative control: this is what ignoring them does."""
    current, moved = searched(known=False)
    assert included(current, moved, "anchor_offset", SCALES) > 0.95
    assert current.evidence.common == 0


def test_evidence_is_by_what_is_estimated_and_what_is_asked_for() -> None:
    """A slope that is held costs nothing, and changes none of the others."""
    fit = searched(known=True)[1].fit
    held = np.array([10, 13])
    unknowns = fit.unknowns
    mask = unknowns.block("anchor_offset").mask.copy()
    mask[held - 9] = False
    block = replace(unknowns.block("anchor_offset"), estimated=mask)
    fewer = replace(fit, unknowns=unknowns.exchanged(block))
    alone = screen(fewer, (), SCALES).evidence
    beside = screen(fewer, (), SCALES, beside=held).evidence
    whole = screen(fit, (), SCALES).evidence
    assert not alone.triangles[:, :, held].any()
    np.testing.assert_allclose(np.abs(beside.triangles), np.abs(whole.triangles), atol=1e-6)
    columns = np.flatnonzero(fewer.free)
    one, other = (np.abs(found.subset(columns).triangles) for found in (alone, whole))
    np.testing.assert_allclose(one[:, :-1], other[:, :-1], atol=1e-6 * one.max())


def test_runs_kept_apart_are_predicted_without_the_errors_found() -> None:
    current, _ = searched(known=True)
    found = current.fit
    held = prepared(runs(TURNED, seed=9))[:1]
    amplitudes = amplitudes_of(found.samples)
    stages = [Stage(found.model, found.inertia, found.values, one) for one in (None, amplitudes)]
    recorded, told = (one.runs[0].prediction for one in held_out(stages, held, None)())
    assert recorded is not None
    assert told is not None
    moved = np.abs(told.measured - recorded.measured).max(axis=0)
    assert moved[:3].max() > 2.0 * NOISE_M, moved
    assert told.rmse_m == pytest.approx(NOISE_M, rel=0.1)
