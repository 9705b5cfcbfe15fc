"""What the likelihood decides, on both sides of every limit, without fitting anything."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.ident.likelihood import session_estimates
from freeswing.ident.likelihood.between_runs import jackknife_std, widened
from freeswing.ident.likelihood.blocks import MODES
from freeswing.ident.likelihood.calibration_modes import modes_notes
from freeswing.ident.likelihood.payload_runs import Loads, mass_of
from freeswing.ident.likelihood.samples_and_noise import prepare
from freeswing.ident.likelihood.unknowns import Unknown, Unknowns
from freeswing.ident.runs import Payload, SwingRun
from freeswing.ident.signals import residual_colour
from freeswing.ident.signals.residual_colour import low_band_factor
from tests.ident.swings import recorded, swing


@pytest.mark.parametrize(("largest", "said"), [(4.4, 0), (-4.6, 1)])
def test_cameras_are_off_from_four_and_a_half_deviations(largest, said):
    modes = Unknown(MODES, np.array([0.1, largest, 2.0]), np.ones(3))
    found = SimpleNamespace(unknowns=Unknowns((modes,)), value=lambda name: modes.value)
    assert len(modes_notes(found)) == said


@pytest.mark.parametrize(("correlation", "by"), [(1.18, 1.0), (1.22, 1.22)])
def test_deviations_are_enlarged_from_a_fifth_of_colour(correlation, by):
    assert residual_colour.enlargement(correlation) == by


@pytest.mark.parametrize(("rate_hz", "low"), [(4.8, True), (5.2, False)])
def test_the_band_of_the_motion_ends_at_five_hertz(rate_hz, low):
    times = np.arange(1000) / 100.0
    factor = low_band_factor([(np.sin(2.0 * np.pi * rate_hz * times)[:, None], times)])
    assert (factor > 1.0) == low, factor


@pytest.mark.parametrize(("inverse", "usable"), [(1.95, False), (2.05, True)])
def test_a_mass_stands_out_by_two_deviations(inverse, usable):
    if usable:
        assert mass_of(inverse, 1.0).mass_kg == 1.0 / inverse
        return
    with pytest.raises(ValueError, match="no usable mass"):
        mass_of(inverse, 1.0)


def test_two_runs_say_nothing_of_each_other():
    """Three do, a jackknife needs as many."""
    large = np.full(2, 100.0)
    assert widened(np.eye(2), large, 2).tolist() == np.eye(2).tolist()
    assert widened(np.eye(2), large, 3)[0, 0] == pytest.approx(1e4)
    rows = [np.array([[1.0, value]]) for value in (0.0, 1.0, 3.0)]
    free, unit, none = np.ones(1, dtype=bool), np.ones(1), np.zeros((0, 2))
    assert jackknife_std(rows[:2], none, free, unit).tolist() == [0.0]
    assert jackknife_std(rows, none, free, unit)[0] > 0.5


def run_of(count: int, coordinates: tuple[str, ...] = ("x", "y")) -> SwingRun:
    """A recorded run of so many samples."""
    run = recorded(swing(2, duration_s=0.6), "a", coordinates=coordinates)
    trajectory = run.trajectory.take(np.arange(len(run.trajectory)) < count)
    return replace(run, trajectory=trajectory)


def test_fifty_samples_are_a_run():
    run = run_of(50)
    whole = (float(run.trajectory.times_s[0]), float(run.trajectory.times_s[-1]))
    assert len(prepare(run, whole).times_s) == 50
    with pytest.raises(ValueError, match="at least 50 are needed"):
        prepare(run_of(49), whole)


def test_noise_that_is_not_stated_is_taken_as_the_manual_says():
    """0.1 mm, 0.5 mrad, lengths to 1 mm; a millionth of that at least."""
    run = run_of(60, POSE_COORDINATES)
    whole = (float(run.trajectory.times_s[0]), float(run.trajectory.times_s[-1]))
    bare = replace(run, lengths_std_m=None)
    found = prepare(bare, whole)
    np.testing.assert_allclose(np.diagonal(found.whitener[0]), np.repeat([1e4, 2e3], 3))
    assert found.lengths_std_m == 1e-3
    assert prepare(replace(run, lengths_std_m=1e-12), whole).lengths_std_m == 1e-7


class Entry(SimpleNamespace):
    """An estimate's entry, of which the values alone are looked at."""


@pytest.mark.parametrize(("astray", "taken"), [(0.48, 0), (0.52, 1)])
def test_a_start_has_led_astray_where_half_the_motion_is_left(monkeypatch, astray, taken):
    """Then the next one is tried; here it is likelier."""
    fits = [SimpleNamespace(deviance=2.0, left=astray), SimpleNamespace(deviance=1.0, left=0.1)]
    monkeypatch.setattr(
        session_estimates, "ml_estimate", lambda *words: (Entry(), fits[int(words[3][0])])
    )
    monkeypatch.setattr(session_estimates, "is_refuted", lambda *_: False)
    monkeypatch.setattr(session_estimates, "astray", lambda found: found.left)
    starts = [np.zeros(9), np.ones(9)]
    found = session_estimates.from_starts(None, [], None, starts, (), None, None)[1]
    assert found is fits[taken]


def test_a_payload_is_a_body_of_five_centimetres():
    """What is believed of its moments about its own centre; of the platform's mass nothing."""
    std = Loads.of([Payload(1.0, np.zeros(3))]).prior_std
    assert std[0] == np.inf
    radii = np.sqrt(std[1:])
    assert ((radii > 0.048) & (radii < 0.052)).all(), radii
