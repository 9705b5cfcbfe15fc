"""What runs with a known mass contradict: what it may be, what it cannot be, and how surely."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.ident.bench.diagnose.channels_only import ByChannels, channels_document
from freeswing.ident.bench.diagnose.entries import mass_candidate, mass_found
from freeswing.ident.bench.fit_rounds import WiresVerdict
from freeswing.ident.bench.mass_verdict import MassVerdict
from freeswing.ident.bench.runs import BenchRun, Signal
from freeswing.ident.bench.told import contradicted
from freeswing.ident.bench.told.budget import MASS, Share
from freeswing.ident.bench.told.contradicted import (
    exchange_sentence,
    group_sentence,
    payload_reasons,
    surely_contradicted,
)
from freeswing.ident.bench.told.held_out import HeldOut
from freeswing.report.panels.answer import verdict
from freeswing.results.diagnosis import Diagnosis
from tests.ident.bench.test_swing_slopes import trifilar

HELD = np.isin(np.arange(10), (1, 2, 3))


def solved_of(
    wires: WiresVerdict | None = None, std_kg: float = 0.001, by_centre: float = 0.0
) -> Any:
    """1.2 kg declared, 1.236 found; by_centre: kg a m of a centre of mass believed to 20 mm."""
    covariance = np.zeros((10, 10))
    covariance[0, 0] = std_kg**2
    covariance[1, 1] = covariance[2, 2] = 0.02**2
    covariance[0, 1] = covariance[1, 0] = by_centre * 0.02**2
    solution = SimpleNamespace(
        std=lambda _: np.sqrt(np.diag(covariance)),
        value=lambda _: np.array([1.236, *np.zeros(9)]),
        covariance_of=lambda _: covariance,
    )
    known = np.array([0.4, 0.4 * 0.12, 0.0, *np.zeros(7)])
    swing = SimpleNamespace(
        model=SimpleNamespace(robot=trifilar()), lengths_m=np.full(3, 1.2), known=known
    )
    held = {"platform": HELD} if by_centre else {}
    mass = MassVerdict(1.2, 1.236, 0.001, True)
    return SimpleNamespace(swings=[swing], solution=solution, mass=mass, wires=wires, held=held)


def names(solved: Any, excluded: bool) -> set[str]:
    return {one.name for one in payload_reasons(solved) if bool(one.excluded) == excluded}


def test_without_sway_wires_and_clock_may_be_it() -> None:
    assert {"wire_length", "frame_rate", "wire_radii", "torsion_spring"} <= names(
        solved_of(), excluded=False
    )
    assert "centre_of_mass" not in names(solved_of(), excluded=False)


@pytest.mark.parametrize(("std_mm", "excluded"), [(11.0, True), (13.0, False)])
def test_sway_excludes_wires_and_clock(std_mm: float, excluded: bool) -> None:
    """3 % of 1.2 m are 36 mm: three deviations of 12 mm."""
    wires = WiresVerdict(1.2, 0.0, 1e-3 * std_mm, 1e-3, False)
    found = names(solved_of(wires), excluded=True)
    assert (found == {"wire_length", "frame_rate"}) == excluded, found
    assert ("It is not L (-3.0 %)" in group_sentence(solved_of(wires))) == excluded


def test_a_sway_that_is_used_already_leaves_nothing() -> None:
    """Wires 36 mm longer by sway: used, so that what the payload runs want comes on top."""
    used = WiresVerdict(1.2, 0.036, 1e-3, 1e-3, True)
    assert names(solved_of(used), excluded=True) == {"wire_length", "frame_rate"}
    put_back = WiresVerdict(1.2, 0.036, 0.013, 1e-3, False)
    assert names(solved_of(put_back), excluded=True) == set()


def test_the_size_of_each() -> None:
    told = group_sentence(solved_of())
    assert "the platform's mass (+3.0 %)" in told, told
    assert "both radii +3.8 mm" in told, told  # 1.5 % of 250 mm
    assert "(-1.5 %: -1.8 mm)" in told, told  # of 120 mm
    spring = 1e3 * 0.036 * 9.80665 * 0.25**2 / 1.2  # m g R r / L of what the mass is off by
    assert f"hold yaw by {spring:+.2g} mN m/rad" in told, told


@pytest.mark.parametrize(("std_kg", "sure"), [(0.0115, True), (0.0125, False)])
def test_a_centre_of_mass_that_explains_it(std_kg: float, sure: bool) -> None:
    """0.036 kg are three deviations of 0.012 kg; at 2 kg a m it takes 18 mm."""
    solved = solved_of(std_kg=std_kg, by_centre=2.0)
    assert surely_contradicted(solved) == sure
    told = group_sentence(solved)
    assert "x -18, y -0 mm" in told or "x -18, y +0 mm" in told, told
    assert ("contradict mass_kg" in told) == sure, told
    assert "opposite sides" in told, told


@pytest.mark.parametrize("sure", [True, False])
def test_channels_alone_say_what_they_tell_and_what_not(sure: bool) -> None:
    wires = WiresVerdict(1.2, -0.01, 1e-3, 1e-3, True)
    solved = solved_of(wires, std_kg=0.001 if sure else 0.03)
    solved.solution.covariance_of = lambda *_: 1e-6 * np.eye(11)
    solved.solution.value = lambda _: np.ones(10)
    held_out = (HeldOut("check", "dot_px", 0.5, 0.4), HeldOut("odd", "dot_px", None, None, "why"))
    identified: Any = SimpleNamespace(solved=solved, validation=held_out)
    document = Diagnosis.from_json(channels_document(ByChannels(identified, ())))
    assert [one.effect for one in document.accepted] == ["platform_mass"] * sure + [
        "cable_length_bias"
    ]
    rows = {one.effect: one for one in document.candidates}
    assert rows["gravity_tilt"].verdict == "not_identifiable"
    assert "frame_rate" not in rows["platform_mass"].confounded_with
    assert rows["cable_length_bias"].part == "all wires"
    assert any("run check was not fitted" in note for note in document.notes), document.notes
    assert "cannot tell whether an effect is missing" in verdict(document)[-1], verdict(document)


def test_wires_that_sway_confirms() -> None:
    solved = solved_of(WiresVerdict(1.2, 1e-4, 1e-3, 1e-3, False))
    solved.mass = None
    identified: Any = SimpleNamespace(solved=solved, validation=())
    rows = channels_document(ByChannels(identified, ()))["candidates"]
    (row,) = [one for one in rows if one["effect"] == "cable_length_bias"]
    assert row["verdict"] == "not_identifiable", row
    assert "as stated, by sway" in row["reason"], row


@pytest.mark.parametrize(
    ("fitted_kg", "std_kg", "all_kg", "verdict", "found"),
    [
        (1.236, 0.001, 0.011, "confounded", 1),
        (1.236, 0.001, 0.013, "not_identifiable", 0),
        (1.201, 0.059, 0.059, "rejected", 0),
        (1.201, 0.061, 0.061, "not_identifiable", 0),
    ],
)
def test_the_declared_mass_is_found_wrong_only_where_it_is_excluded(
    fitted_kg, std_kg, all_kg, verdict, found
) -> None:
    """The same for poses and for channels: what runs only speak against may be right."""
    solved = solved_of(std_kg=all_kg)
    solved.mass = MassVerdict(1.2, fitted_kg, std_kg, fitted_kg > 1.21)
    (row,) = mass_candidate(solved)
    assert (row["verdict"], len(mass_found(solved))) == (verdict, found), row
    solved.mass = None
    assert not mass_candidate(solved)
    assert not mass_found(solved)


@pytest.mark.parametrize(
    ("fitted_kg", "may_be", "cannot"),
    [(1.211, True, False), (1.189, False, True), (1.213, False, False)],
)
def test_wires_that_give_way_may_be_it_where_little_is_off(fitted_kg, may_be, cannot) -> None:
    """Up to a hundredth, and only if they become longer under what hangs on them."""
    solved = solved_of()
    solved.mass = MassVerdict(1.2, fitted_kg, 0.001, True)
    assert ("yielding_clamp" in names(solved, excluded=False)) == may_be
    assert ("yielding_clamp" in names(solved, excluded=True)) == cannot


def test_nothing_looked_for_is_not_nothing_missing() -> None:
    """A diagnosis whose runs were predicted by nothing does not say that all is explained."""
    told = {"effect": "gravity_tilt", "verdict": "not_identifiable"}
    (said,) = verdict(
        Diagnosis.from_json({"format": "freeswing-diagnosis/1", "candidates": [told]})
    )
    assert said == "These data cannot tell whether an effect is missing."


def run_of(names: tuple[str, ...], lengths_mm: list[float], std_mm: float | None = 2.0) -> BenchRun:
    times = np.arange(3.0)
    signals = tuple(Signal(name, times) for name in names)
    std_m = None if std_mm is None else 1e-3 * std_mm
    return BenchRun("a", "identify", times, signals, 1e-3 * np.array(lengths_mm), std_m)


@pytest.mark.parametrize(("longest_mm", "std_mm", "told"), [
    (1201.9, 2.0, False), (1202.1, 2.0, True), (1200.9, None, False), (1201.1, None, True),
])  # fmt: skip
def test_wires_that_nobody_could_tell_apart(longest_mm, std_mm, told) -> None:
    """Lengths that differ by more than they are known to, and nothing that sees a tilt."""
    for names in (("chi",), ("x", "y", "chi")):
        run = run_of(names, [1200.0, longest_mm, 1200.5], std_mm)
        assert bool(exchange_sentence([run])) == told, names
    poses = run_of(("x", "y", "z", "phi", "theta", "chi"), [1200.0, longest_mm, 1200.5], std_mm)
    assert exchange_sentence([poses]) == ""
    assert exchange_sentence([poses, run_of(("chi",), [1200.0, longest_mm, 1200.5])]) == ""


@pytest.mark.parametrize(
    ("largest", "share", "stated", "said"),
    [
        (MASS, 0.0021, False, True),
        (MASS, 0.0019, False, False),
        (MASS, 0.0021, True, False),
        ("wire lengths", 0.0021, False, False),
    ],
)
def test_a_mass_worth_weighing_is_named(monkeypatch, largest, share, stated, said) -> None:
    """By the best fixtures' 0.2 % of Izz, where nothing adds more and nobody says how well."""
    monkeypatch.setattr(contradicted, "budget", lambda *_: [Share(largest, 0.04 * share)])
    solved = solved_of()
    solved.mass = MassVerdict(1.2, 1.201, 0.01, False, stated)
    solved.doubts = {"platform": np.zeros(10), "effects": np.zeros(3)}
    solved.solution.value = lambda _: np.full(10, 0.04)
    told = contradicted.open_sentence(solved)
    assert ("mass_std_kg" in told) == said, told
    assert "0.21 % of that of the platform" in told or not said, told
