"""Which residuals are looked into, and how an effect leaves again: both sides of each limit."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.effects.base import Parameter
from freeswing.ident.diagnose import spectrum
from freeswing.ident.diagnose.backward_removal import superfluous
from freeswing.ident.diagnose.leave_one_out import Evidence
from freeswing.ident.diagnose.sets import fits_as_rivals


@pytest.mark.parametrize(
    ("position_um", "angle_urad", "small"), [(19, 95, True), (21, 95, False), (19, 105, False)]
)
def test_residuals_that_no_calibration_can_be_trusted_to(position_um, angle_urad, small) -> None:
    runs = [SimpleNamespace(slow=None)] * 2
    fit = SimpleNamespace(noise=1e-6 * np.array([position_um, angle_urad]), samples=runs)
    assert spectrum.too_small(fit) == small


@pytest.mark.parametrize(("stating", "small"), [(2, False), (1, True)])
def test_poses_that_state_how_far_they_err_together_are_trusted_to_that(stating, small) -> None:
    """A day in the laboratory: a tilt of 3.5 mrad leaves 0.014 mm and 0.08 mrad (0.012, 0.07)."""
    runs = [SimpleNamespace(slow=object() if k < stating else None) for k in range(2)]
    fit = SimpleNamespace(noise=np.array([1.4e-5, 8e-5]), samples=runs)
    assert spectrum.too_small(fit) == small


@pytest.mark.parametrize(("slow_hz", "found_hz"), [(0.135, 1.0), (0.17, 0.17)])
def test_what_is_slower_than_a_seventh_of_a_hertz_is_a_drift(monkeypatch, slow_hz, found_hz):
    """Three times as large as a wave of 1 Hz."""
    times = np.arange(1000) / 5.0
    noise = 0.01 * np.random.default_rng(0).standard_normal(1000)
    wave = 3.0 * np.sin(2.0 * np.pi * slow_hz * times) + np.sin(2.0 * np.pi * times) + noise
    monkeypatch.setattr(spectrum, "residuals", lambda *_: wave[:, None])
    run = SimpleNamespace(times_s=times, span_s=(0.0, 200.0))
    fit = SimpleNamespace(samples=[run], motions=[None])
    assert spectrum.common_frequencies(fit, np.ones(2))[0] == pytest.approx(found_hz, abs=0.01)


def lines(monkeypatch, *waves):
    """Frequencies that are found in ten runs of 10 s with waves of (Hz, size) in white noise."""
    times = np.arange(1000) / 100.0
    off = 0.5 * np.random.default_rng(0).standard_normal((10, 1000, 1))
    for hz, size in waves:
        off[..., 0] += size * np.sin(2.0 * np.pi * hz * times)
    monkeypatch.setattr(spectrum, "residuals", lambda run, *_: off[run])
    runs = [SimpleNamespace(times_s=times, span_s=(0.0, 10.0))] * 10
    fit = SimpleNamespace(samples=runs, motions=range(10))
    return spectrum.common_frequencies(fit, np.ones(2))


def test_a_fan_is_looked_for_beside_three_modes_that_stand_out_more(monkeypatch) -> None:
    modes = [(3.0, 40.0), (6.0, 20.0), (11.0, 10.0), (14.0, 5.0), (17.0, 2.0)]
    found = lines(monkeypatch, *modes)
    assert len(found) == 4
    assert found == pytest.approx((3.0, 6.0, 11.0, 14.0), abs=0.03)


def test_the_shoulder_of_a_line_is_no_line_of_its_own(monkeypatch) -> None:
    """A weak one elsewhere is."""
    assert lines(monkeypatch, (5.0, 1.1), (9.0, 0.07))[:2] == pytest.approx((5.0, 9.0), abs=0.03)


def test_two_lines_that_runs_resolve_are_two(monkeypatch) -> None:
    """Of 10 s: two tenths of a hertz apart."""
    found = sorted(lines(monkeypatch, (5.0, 8.0), (5.23, 8.0))[:2])
    assert found[1] - found[0] < 0.245, found
    assert found == pytest.approx([5.0, 5.23], abs=0.03)


@pytest.mark.parametrize(("rise", "leaves"), [(9.3, True), (10.7, False)])
def test_an_effect_worth_a_fit_without_it(rise, leaves) -> None:
    """By its square in deviations, less what a thousand samples ask of an unknown."""
    value = np.sqrt(rise + np.log(1000.0))
    current = SimpleNamespace(
        evidence=SimpleNamespace(counts=np.full(4, 250.0)), effects=("drag",),
        values_of=lambda name: slice(0, 1),
        fit=SimpleNamespace(
            model=SimpleNamespace(parameters=(Parameter("size", -1.0, 1.0, 0.1),)),
            unknowns=SimpleNamespace(block=lambda name: SimpleNamespace(mask=np.ones(1, bool))),
            values=np.array([value]), covariance_of=lambda name: np.eye(1),
        ),
    )  # fmt: skip
    assert superfluous(current, ()) == ("drag" if leaves else "")


def test_a_platforms_inertia_is_one_of_a_metres_size(monkeypatch) -> None:
    """Its centre of mass within half a metre, moments of a radius within 45 cm, products half."""
    monkeypatch.setattr(fits_as_rivals, "known_rows", lambda *_: np.zeros((0, 10)))
    one = SimpleNamespace(
        fit=SimpleNamespace(
            free=np.ones(9, bool), model=SimpleNamespace(robot=None), values=None, samples=()
        ),
        evidence=Evidence(("run",), np.zeros((1, 10, 10)), np.ones(1), np.zeros((0, 10))),
    )
    std = 1.0 / fits_as_rivals.rival_of(one).prior[:, :9].diagonal()
    assert std == pytest.approx(np.repeat([0.5, 0.2, 0.1], 3), rel=0.05)
