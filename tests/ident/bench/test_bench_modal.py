"""Runs whose scale nobody knows: small oscillations, and what is held instead of fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.rotation import matrix_from_angles
from freeswing.ident.bench.assemble import EFFECTS, Assembled, assembled
from freeswing.ident.bench.channels import Channel
from freeswing.ident.bench.held_uncertain import believed, considered, gauge, unseen
from freeswing.ident.bench.modal import ModalSwing
from freeswing.ident.bench.runs import Bench, BenchRun, KnownBody, Load, Placed, Signal
from freeswing.ident.bench.swing import BenchSwing
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_blocks import Dense
from freeswing.ident.likelihood.unknowns import Unknown, Unknowns
from tests.ident.bench.test_swing_slopes import slopes_are_those_of_differences, trifilar

LARGE = 1.5e-4  # 0.1 % of the amplitude: what the fourth power of it does
LENGTHS = np.full(3, 1.2)


def dots() -> Bench:
    """Two runs of two uncalibrated dots, one with a payload."""
    times = np.linspace(0.0, 3.0, 90)
    chi, x = 0.08 * np.cos(5.0 * times), 0.01 * np.sin(2.85 * times)
    seen = (Signal("dot", 900.0 * chi + 800.0 * x), Signal("dot_y", 20.0 * chi + 300.0 * x))
    weight = KnownBody(0.3, np.array([0.1, 0.0, 0.0]), np.zeros(6))
    runs = (
        BenchRun("a", "identify", times, seen, LENGTHS, 1e-3),
        BenchRun("b", "identify", times, seen, LENGTHS, 1e-3, payloads=(weight,)),
    )
    coordinates = ("chi", "x", "y")
    return Bench(runs, (Channel("d", "dot", coordinates, 2), Channel("e", "dot_y", coordinates)))


def started(bench: Bench) -> Assembled:
    return assembled(build_model(trifilar(), EFFECTS), bench, bench.runs)


def test_runs_without_a_measured_coordinate_are_small_oscillations() -> None:
    bench = dots()
    assert all(isinstance(swing, ModalSwing) for swing in started(bench).swings)
    chi = replace(bench.runs[0], signals=(Signal("chi", 0.1 * np.cos(bench.runs[0].times_s)),))
    mixed = started(replace(bench, runs=(*bench.runs, chi)))
    assert not any(isinstance(swing, ModalSwing) for swing in mixed.swings)
    assert [swing.place for swing in mixed.swings] == [0, 1, 2]


def test_slopes_of_a_small_oscillation_are_those_of_differences() -> None:
    slopes_are_those_of_differences(dots())


@pytest.mark.parametrize(("turn_rad", "limit_rad"), [(1e-3, 6e-8), (0.15, LARGE)])
def test_a_small_oscillation_is_the_simulated_swing(turn_rad: float, limit_rad: float) -> None:
    """Yaw alone, damped; at 0.15 rad the period's growth is within 0.02 % of an amplitude."""
    start = started(dots())
    small = start.swings[0]
    fields = (name for base in BenchSwing.__mro__ for name in getattr(base, "__slots__", ()))
    whole = BenchSwing(**{name: getattr(small, name) for name in fields})
    values = dict(start.unknowns.of_run(0))
    yaw = small.chart.free.T @ np.eye(6)[5]
    values["start"] = np.concatenate([turn_rad * yaw, np.zeros(3)])
    values["effects"] = np.array([5e-4, 0.0, 0.5])
    times = np.linspace(0.0, 3.0, 60)
    seen = [swing.simulated(values).at(times)[0][:, 5] for swing in (small, whole)]
    assert np.abs(seen[0] - seen[1]).max() < limit_rad, np.abs(seen[0] - seen[1]).max()


def test_what_is_held_spreads_as_believed() -> None:
    """Two numbers seen through slopes a, b with noise 1; b's is held, believed to 0.5.

    The estimate of a is then off by the held one's spread times (a.b) / (a.a), and its noise is
    that of a alone (Tapley, Schutz, Born 2004, sec. 6.4).
    """
    rng = np.random.default_rng(4)
    a, b = rng.normal(size=(2, 40))
    information = np.array([[a @ a, a @ b], [a @ b, b @ b + 1.0 / 0.5**2]])
    found = believed(np.linalg.inv(information), np.array([1]), np.array([0.5]))
    expected = 1.0 / (a @ a) + (0.5 * (a @ b) / (a @ a)) ** 2
    assert found[0, 0] == pytest.approx(expected, rel=1e-12)
    assert found[1, 1] == pytest.approx(0.25, rel=1e-12)


def test_what_no_run_tells_is_held() -> None:
    bench, start = dots(), started(dots())
    held = unseen(bench, bench.runs, start.unknowns)
    assert np.flatnonzero(held["platform"]).tolist() == [1, 2, 3, 4, 5, 7, 8, 9]
    assert set(held) == {"platform"}
    named = gauge(bench, bench.runs, start.unknowns)
    assert np.flatnonzero(named["channel.d"]).tolist() == [0, 1, 2]
    assert np.flatnonzero(named["channel.e"]).tolist() == [1, 2]
    x = replace(bench.runs[0], signals=(Signal("x", np.zeros(90)), Signal("chi", np.zeros(90))))
    assert not unseen(bench, (*bench.runs, x), start.unknowns)
    assert not any(mask.any() for mask in gauge(bench, (*bench.runs, x), start.unknowns).values())


@pytest.mark.parametrize(
    ("turn", "held"),
    [
        (np.eye(3), [1, 2, 3, 4, 5, 7, 8, 9]),  # Izz alone is turned
        (np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]), [1, 2, 3, 4, 6, 7, 8, 9]),
        (matrix_from_angles(np.array([0.3, 0.0, 0.0])), [1, 2, 3, 4, 7, 8]),
    ],
)
def test_of_an_object_yaw_shows_what_it_turns(turn, held) -> None:
    """Upright Izz, on its side Iyy, leaning about x both and Iyz: each entry that v' I v has."""
    yaw = BenchRun("a", "identify", np.arange(9.0), (Signal("chi", np.zeros(9)),), np.ones(3))
    runs = [replace(yaw, loads=(Placed("cube", turn, np.zeros(3)),))]
    blocks = [Unknown(name, np.ones(10), np.ones(10)) for name in ("platform", "load.cube")]
    bench = Bench(tuple(runs), loads=(Load("cube", 1.0),))
    found = unseen(bench, runs, Unknowns(tuple(blocks)))
    assert np.flatnonzero(found["load.cube"]).tolist() == held


def test_a_fit_counts_what_it_holds() -> None:
    """The covariance of the held numbers is what is believed of them, others grow."""
    bench, start = dots(), started(dots())
    held = unseen(bench, bench.runs, start.unknowns)
    tight = start.unknowns
    for name in held:
        tight = tight.held(name)
    found = fit(start.swings, tight, Dense(steps=0))
    told = considered(start.swings, found, held)
    spread = start.unknowns.block("platform").prior
    assert spread is not None
    np.testing.assert_allclose(told.std("platform")[1:4], spread.std[1:4], rtol=1e-6)
    assert (told.std("wires.1") >= found.std("wires.1") * (1 - 1e-9)).all()
    assert considered(start.swings, found, {}) is found


@pytest.mark.parametrize(("decay_m2_s", "limit_rad"), [(0.0, 2e-4), (0.0017, 2e-4)])
def test_yaw_slows_down_with_what_is_left_of_it(decay_m2_s: float, limit_rad: float) -> None:
    """Twenty seconds, in which it halves: its frequency goes with its amplitude all the time.

    Held at that of the run's mean it was 0.001 rad off.
    """
    start = started(dots())
    small = replace(start.swings[0], times_s=np.linspace(0.0, 20.0, 600))
    fields = (name for base in BenchSwing.__mro__ for name in getattr(base, "__slots__", ()))
    whole = BenchSwing(**{name: getattr(small, name) for name in fields})
    values = dict(start.unknowns.of_run(0))
    yaw = small.chart.free.T @ np.eye(6)[5]
    values["start"] = np.concatenate([0.12 * yaw, np.zeros(3)])
    values["effects"] = np.array([decay_m2_s, 0.0, 0.5])
    times = np.linspace(0.0, 20.0, 400)
    seen = [swing.simulated(values).at(times)[0][:, 5] for swing in (small, whole)]
    left = np.abs(seen[1][-60:]).max() / 0.12
    assert (left < 0.6) == (decay_m2_s > 0.0), left
    assert np.abs(seen[0] - seen[1]).max() < limit_rad, np.abs(seen[0] - seen[1]).max()
