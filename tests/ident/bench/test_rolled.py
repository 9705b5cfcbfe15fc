"""On two wires an object laid aside hangs rolled: its Izz then rests on what no twist tells."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import POSE_COORDINATES, Cable, Robot
from freeswing.ident.bench.objects import moments
from freeswing.ident.bench.runs import BenchRun, Placed, Signal
from freeswing.ident.bench.told import rolled
from freeswing.ident.bench.told.budget import ACROSS, BESIDE_IZZ, SAMPLES, Share, sources
from freeswing.ident.likelihood.unknowns import Unknown, Unknowns

PLATFORM = np.array([1.2, 0.003, -0.002, -0.05, 0.02, 0.02, 0.04, 0.0, 0.0, 0.0])
LOAD = np.array([0.8, 0.004, -0.006, 0.01, 0.006, 0.007, 0.009, 0.0, 0.0, 0.0])
WIRE_M = 1.2
TIMES = np.linspace(0.0, 1.0, 11)


def hanging(turn_rad: float = 0.0, shift_m: tuple[float, float] = (0.0, 0.0)) -> SimpleNamespace:
    """A run on two wires whose ends lie along a line that is turned from x."""
    along = np.array([np.cos(turn_rad), np.sin(turn_rad), 0.0])
    wires = tuple(
        Cable(str(k), 0.2 * side * along + [0.0, 0.0, WIRE_M], 0.0, 0.2 * side * along)
        for k, side in enumerate((1.0, -1.0))
    )
    model = build_model(Robot("two", wires, np.array([0.0, 0.0, -9.80665])))
    total = moments(PLATFORM) + moments(LOAD, None, np.array([*shift_m, 0.0]))
    lengths = np.full(2, WIRE_M)
    return SimpleNamespace(
        model=model, total=lambda _: total, lengths=lambda _: lengths, rest=np.zeros(6)
    )


def told(
    largest: str,
    names: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
    shift_m: tuple[float, float] = (0.0, 0.0),
) -> list[str]:
    """What is said of an object whose Izz hangs most on something, by what its run measures."""
    shares = [Share(largest, 1e-4), Share(SAMPLES, 1e-6)]
    monkeypatch.setattr(rolled, "budget", lambda *_: shares)
    swing = hanging(0.0, shift_m)
    blocks = Unknowns(tuple(Unknown(n, b, np.ones(10)) for n, b in BODIES.items()))
    signals = tuple(Signal(name, TIMES) for name in names)
    placed = (Placed("cube", np.eye(3), np.zeros(3)),)
    run = BenchRun("a", "identify", TIMES, signals, np.full(2, WIRE_M), loads=placed)
    stds = {name: 0.1 * np.abs(body) for name, body in BODIES.items()}
    solution = SimpleNamespace(unknowns=blocks, value=BODIES.get, std=stds.get)
    return rolled.rolled_sentences(SimpleNamespace(solution=solution, swings=(swing,)), [run])


BODIES = {"platform": PLATFORM, "load.cube": LOAD}


def test_how_far_it_hangs_rolled() -> None:
    """The common centre hangs under the line of the wires' ends, whose middle is P."""
    total = hanging().total({})
    expected = np.arctan2(total[2], total[3])
    assert rolled.roll(hanging(), {}) == pytest.approx(np.pi - abs(expected), abs=1e-6)
    assert np.degrees(rolled.roll(hanging(), {})) > 5.0, "the case is worth a word"


@pytest.mark.parametrize("turn_rad", [0.0, 0.7])
def test_moved_as_told_it_hangs_level(turn_rad: float) -> None:
    shift = rolled.level_shift(hanging(turn_rad), {}, LOAD[0])
    assert rolled.roll(hanging(turn_rad), {}) > 0.05
    # A centre beside the middle along the line is carried by unequal tensions: no roll.
    assert rolled.roll(hanging(turn_rad, (shift[0], shift[1])), {}) < 1e-6


def test_what_helps_is_said_where_it_matters(monkeypatch: pytest.MonkeyPatch) -> None:
    (posed,) = told(ACROSS.format(name="cube"), POSE_COORDINATES, monkeypatch)
    assert "hangs rolled by" in posed
    assert "mm along y" in posed
    (yaw,) = told(ACROSS.format(name="the platform"), ("chi",), monkeypatch)
    assert "spirit level" in yaw
    assert "not measured" in yaw
    assert told("wire lengths", POSE_COORDINATES, monkeypatch) == []
    assert told("wire lengths", ("chi",), monkeypatch) == []


def test_a_track_of_unknown_scale_says_which_run_would_help(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Whatever its budget's largest line is: the bound of such sessions is 4.7 %."""
    (track,) = told("wire lengths", (), monkeypatch)
    assert "known to 10 %" in track
    assert "chi_rad" in track


@pytest.mark.parametrize(("roll_deg", "said"), [(1.7, 0), (2.3, 1)])
def test_two_degrees_cost_nothing(
    roll_deg: float, said: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Measured: at 36 mrad the bound is 0.16 % where it is 0.14 % level and 0.76 % at 132 mrad."""
    total = hanging().total({})
    wanted = -np.tan(np.deg2rad(roll_deg)) * abs(total[3]) - total[2]
    shift = (0.0, wanted / LOAD[0])
    assert np.degrees(rolled.roll(hanging(0.0, shift), {})) == pytest.approx(roll_deg, abs=0.01)
    assert len(told(ACROSS.format(name="cube"), POSE_COORDINATES, monkeypatch, shift)) == said


def test_moments_beside_izz_are_a_line_of_the_budget() -> None:
    """All five of a body, and neither its mass, its centre nor Izz itself."""
    blocks = Unknowns(tuple(Unknown(n, b, np.ones(10)) for n, b in BODIES.items()))
    found = sources(SimpleNamespace(solution=SimpleNamespace(unknowns=blocks)))
    names = np.array(["m", "x", "y", "z", "xx", "yy", "zz", "xy", "xz", "yz"])
    assert set(names[BESIDE_IZZ]) == {"xx", "yy", "xy", "xz", "yz"}
    np.testing.assert_array_equal(found[ACROSS.format(name="the platform")], BESIDE_IZZ)
    np.testing.assert_array_equal(found[ACROSS.format(name="cube")], np.add(BESIDE_IZZ, 10))
