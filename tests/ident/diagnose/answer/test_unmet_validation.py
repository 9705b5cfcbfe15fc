"""Validation runs that an answer does not meet although it meets the runs it was fitted to."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.ident.diagnose.answer import taken_back
from freeswing.ident.diagnose.answer.not_the_cause import unless_validated
from freeswing.ident.diagnose.answer.unmet_validation import share_removed, unmet, with_unmet
from freeswing.ident.diagnose.heldout import HeldOut, HeldOutRun
from freeswing.ident.diagnose.unexplained import Unexplained
from freeswing.ident.judge.prediction import Prediction

NOISE_M = 1e-4


def held(**over_noise: float) -> HeldOut:
    """Validation runs predicted so many times worse than their noise."""
    return HeldOut(tuple(one_run(name, times) for name, times in over_noise.items()))


def one_run(name: str, times: float) -> HeldOutRun:
    predicted = np.full((4, 3), times * NOISE_M)
    coordinates = ("x", "y", "z")
    motion = Prediction(name, np.arange(4.0), coordinates, np.zeros((4, 3)), predicted, np.zeros(0))
    return HeldOutRun(name, 1.0, motion, NOISE_M)


@pytest.mark.parametrize(("times", "met"), [(1.15, True), (1.25, False)])
def test_a_fifth_more_than_the_noise_is_no_chance(times, met) -> None:
    assert (unmet(held(one=times), 1.0) is None) == met


@pytest.mark.parametrize(("times", "met"), [(3.5, True), (3.7, False)])
def test_what_fitted_runs_lack_too_is_not_said_again(times, met) -> None:
    assert (unmet(held(one=times), 3.0) is None) == met


def test_the_worst_run_is_named_and_how_far_it_is_off() -> None:
    runs = held(calm=1.0, near=8.0, far=2.0)
    told = with_unmet(Unexplained(False, "", {"colour": 1.1}), runs)
    assert told.present
    assert "validation run near is predicted 8.0 times worse than its noise" in told.signature
    assert "though fitted runs are met" in told.signature
    assert told.evidence["colour"] == 1.1
    assert told.evidence["held_out_over_noise"] == pytest.approx(np.sqrt(69 / 3))


def test_where_fitted_runs_are_not_met_either_it_says_how_far() -> None:
    told = with_unmet(Unexplained(True, "", {}, 2.0), held(near=8.0))
    assert "8.0 times worse than its noise, fitted runs 2.0 times" in told.signature


def test_a_run_that_could_not_be_predicted_says_nothing() -> None:
    assert unmet(HeldOut((HeldOutRun("lost", 1.0, None, NOISE_M),)), 1.0) is None


def test_the_share_is_of_the_power_beyond_the_noise() -> None:
    assert share_removed(held(one=3.0), held(one=2.0)) == pytest.approx(1 - 3 / 8)
    assert share_removed(held(one=1.0), held(one=1.0)) == 0.0


@pytest.mark.parametrize(("left", "believed"), [(4.9, True), (5.1, False), (1.15, True)])
def test_forces_that_leave_validation_runs_unmet_are_not_the_cause(left, believed) -> None:
    """A quarter of the power beyond the noise of runs ten times their noise is sqrt(25.75)."""
    by_lengths: Any = SimpleNamespace(by_lengths=True, before="declared")
    force: Any = SimpleNamespace(
        by_lengths=False, before="geometry", decision=SimpleNamespace(key="cable_mass")
    )
    ladder = [held(one=20.0), held(one=10.0), held(one=left)]
    fewer = unless_validated([by_lengths, force], ladder, Unexplained(False, ""))
    assert (fewer is None) == believed
    if fewer is not None:
        assert (fewer.last, fewer.accepted) == ("geometry", [by_lengths])
        assert "cable_mass would remove only 75 % of the validation" in fewer.note


def test_geometry_that_lengths_settled_stays() -> None:
    settled: Any = SimpleNamespace(by_lengths=True, before="declared")
    assert unless_validated([settled], [held(one=20.0)] * 2, Unexplained(False, "")) is None


@pytest.mark.parametrize(
    ("after", "by_lengths", "at_the_noise", "stays"),
    [
        (0.999, False, True, True),
        (1.001, False, True, False),
        (1.001, False, False, True),
        (1.001, True, True, True),
    ],
)
def test_what_is_found_at_the_noise_must_show_in_validation_runs(
    monkeypatch, after, by_lengths, at_the_noise, stays
) -> None:
    """A force at 11 Hz beside friction on pulleys: 0.9322 of the noise, 0.9336 with it."""
    monkeypatch.setattr(taken_back, "lacks_little", lambda _: at_the_noise)
    before: Any = SimpleNamespace(effects=("pulley_friction",))
    rounds: Any = [
        SimpleNamespace(by_lengths=False, decision=SimpleNamespace(key="pulley_friction")),
        SimpleNamespace(
            by_lengths=by_lengths, decision=SimpleNamespace(key="harmonic_force"), before=before
        ),
    ]
    ladder = [held(one=7.0), held(one=1.0), held(one=after)]
    fewer = taken_back.unshown(rounds, before, ladder, np.ones(2))
    assert (fewer is None) == stays
    if fewer is not None:
        assert (fewer.last, fewer.accepted) == (before, rounds[:1])
        assert "harmonic_force was found at the noise" in fewer.note


def test_where_nothing_was_accepted_nothing_is_asked_of_validation_runs() -> None:
    last: Any = None
    assert taken_back.unshown([], last, [held(one=1.0)], np.ones(2)) is None
