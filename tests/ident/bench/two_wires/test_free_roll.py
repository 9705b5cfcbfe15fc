"""Two wires and yaw alone: what roll shows of a body, and what is believed of bodies before."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.files.problems import DataError, InputError
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import Cable, Robot
from freeswing.ident.bench.assemble import EFFECTS, assembled
from freeswing.ident.bench.identify_bench import identify_bench
from freeswing.ident.bench.objects import moments
from freeswing.ident.bench.runs import Bench, BenchRun, Load, Placed, Signal
from freeswing.ident.bench.two_wires import free_roll
from freeswing.ident.bench.two_wires.free_roll import (
    between,
    held_possible,
    not_freed_sentence,
    possible_body,
    rolls_unseen,
    sides,
)
from freeswing.ident.bench.two_wires.level import lean
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown, Unknowns
from freeswing.session.load_bench import load_bench
from freeswing.session.load_swings import load_robot
from freeswing.session.session_file import read_session
from tests.ident.bench.test_swing_slopes import slopes_are_those_of_differences, trifilar
from tests.oracle.recorded.benches import BOTH_SIDES_M, LEVEL_M, make_bench

ENDS = np.array([[0.2, 0.0, 0.0], [-0.2, 0.0, 0.0]])
IZZ = 0.04
HELD = np.isin(np.arange(10), (1, 2, 3, 4, 5, 7, 8, 9))
STD = np.array([0.1, 0.004, 0.004, 0.06, 0.1, 0.1, 0.1, 0.012, 0.012, 0.012])


def body() -> Unknown:
    """A platform of which yaw has told Izz; all else is held where it was guessed."""
    value = np.array([1.2, 0.0, 0.0, -0.06, 0.07, 0.07, IZZ, 0.0, 0.0, 0.0])
    return Unknown("platform", value, STD, Gaussian(value, STD, "its wires' spread"), ~HELD)


def of_izz(height: float, width: float) -> float:
    """A cylinder's moment across over that about its axis, which stands upright."""
    return (width**2 / 16.0 + height**2 / 12.0) / (width**2 / 8.0)


@pytest.mark.parametrize(
    ("wires", "held", "scaled", "free"),
    [
        (2, {"platform": HELD}, True, True),
        (2, {"platform": HELD}, False, False),
        (3, {"platform": HELD}, True, False),
        (2, {}, True, False),
        (2, {"platform": np.arange(10) == 0}, True, False),
    ],
)
def test_roll_shows_what_two_wires_leave_unseen(wires, held, scaled, free) -> None:
    model = SimpleNamespace(robot=SimpleNamespace(n_cables=wires))
    assert rolls_unseen(model, held, scaled) == free
    assert bool(not_freed_sentence(model, held, scaled)) == free, "held at a fit's end all the same"


def test_held_moments_spread_as_those_of_bodies_that_have_this_izz() -> None:
    """Held at 0.07 where 0.032 is likeliest, +- 0.04: what that is off by counts beside it."""
    found = held_possible(Unknowns((body(),)), {"platform": HELD}).block("platform")
    np.testing.assert_array_equal(found.value, body().value)
    assert found.prior is not None
    np.testing.assert_allclose(found.prior.std[4:6], np.hypot(IZZ, 0.07 - 0.8 * IZZ))
    others = np.r_[0:4, 6:10]
    np.testing.assert_array_equal(found.prior.std[others], STD[others])
    nothing = held_possible(Unknowns((body(),)), {"platform": np.zeros(10, bool)})
    spread = nothing.block("platform").prior
    assert spread is not None
    np.testing.assert_array_equal(spread.std, STD)


def test_moments_across_are_those_of_a_body_with_this_izz() -> None:
    """In the middle a cylinder two thirds as high as wide, at two deviations one of 1.9 widths."""
    block = possible_body(body(), HELD)
    assert block.prior is not None
    middle, std = block.prior.mean[4:6] / IZZ, block.prior.std[4:6] / IZZ
    np.testing.assert_allclose(middle, of_izz(0.67, 1.0), rtol=0.15)
    np.testing.assert_allclose(middle + 2.0 * std, of_izz(1.87, 1.0), rtol=0.15)
    np.testing.assert_allclose(std, 1.0, rtol=0.15)
    np.testing.assert_array_equal(block.value[4:6], block.prior.mean[4:6])


def test_no_moment_is_below_a_thin_rods() -> None:
    """About its own length, and nine times as long as thick: 1.5 / 81 of the moment across."""
    block = possible_body(body(), HELD)
    assert block.low is not None
    np.testing.assert_allclose(block.low[4:6] / IZZ, 1.5 / 81.0, rtol=0.1)
    unknowns = Unknowns((block,)).moved({"platform": -np.ones(10)})
    assert (unknowns.value("platform")[4:6] > 0.0).all()


def test_what_yaw_shows_and_what_was_stated_stay_as_they_were() -> None:
    block = possible_body(body(), HELD)
    kept = [0, 1, 2, 3, 6, 7, 8, 9]
    assert block.prior is not None
    np.testing.assert_array_equal(block.value[kept], body().value[kept])
    np.testing.assert_array_equal(block.prior.std[kept], STD[kept])
    assert possible_body(body(), np.zeros(10, bool)) is not None
    np.testing.assert_array_equal(possible_body(body(), ~np.ones(10, bool)).value, body().value)


def test_an_object_on_its_side_is_as_large_as_the_moment_that_yaw_shows() -> None:
    held = np.isin(np.arange(10), (5, 6))  # Ixx stood upright
    block = possible_body(body(), held)
    np.testing.assert_allclose(block.value[5:7], 0.8 * body().value[4], rtol=1e-12)


def test_a_search_starts_on_either_side_of_the_line_of_the_wires() -> None:
    """Half a deviation aside: where the middle of each half of a bell lies, to a quarter."""
    robot = SimpleNamespace(attachments_m=ENDS, gravity_m_s2=np.array([0.0, 0.0, -9.8]))
    starts = [one.value("platform")[1:4] for one in sides(robot, Unknowns((body(),)))]
    moved = np.array(starts) - body().value[1:4]
    np.testing.assert_allclose(moved[:, [0, 2]], 0.0, atol=1e-12)
    assert moved[0, 1] == -moved[1, 1]
    assert abs(moved[0, 1]) == pytest.approx(0.5 * STD[2], rel=0.15)


@pytest.mark.parametrize(("dearer", "share"), [(0.0, 0.5), (2.0, 0.269), (40.0, 0.0)])
def test_minima_that_are_as_likely_count_as_a_doubt(dearer, share) -> None:
    """Of two equally likely places the other is right in half of all cases."""

    def at(place: float, cost: float) -> SimpleNamespace:
        unknown = Unknown("platform", np.array([place, 0.0]), np.ones(2))
        return SimpleNamespace(unknowns=Unknowns((unknown,)), cost=cost)

    added = between(at(1.0, 100.0), [at(4.0, 100.0 + dearer)])
    np.testing.assert_allclose(added, [[9.0 * share, 0.0], [0.0, 0.0]], atol=0.02)


def test_a_search_that_ends_nowhere_frees_nothing(monkeypatch) -> None:
    """Neither where no start can be simulated, nor where none has converged."""
    robot = SimpleNamespace(attachments_m=ENDS, gravity_m_s2=np.array([0.0, 0.0, -9.8]))
    asked = SimpleNamespace(robot=robot), (), Unknowns((body(),)), {"platform": HELD}

    def nowhere(*_):
        raise ValueError("run a: no stable rest pose")

    monkeypatch.setattr(free_roll, "fit", nowhere)
    assert free_roll.freed(*asked, Unknowns((body(),))) is None
    monkeypatch.setattr(free_roll, "fit", lambda *_: SimpleNamespace(converged=False))
    assert free_roll.freed(*asked, Unknowns((body(),))) is None


def test_a_platform_hangs_with_its_centre_under_the_line() -> None:
    """Its roll at rest and the slopes of it, wherever the line lies in the platform."""
    robot = SimpleNamespace(
        attachments_m=ENDS + np.array([0.0, 0.01, 0.02]), gravity_m_s2=np.array([0.0, 0.0, -9.8])
    )
    total = moments(np.array([2.0, 0.03, 0.002, -0.05, 0.02, 0.02, 0.04, 0.0, 0.0, 0.0]))
    rolled, slope = lean(total, robot)
    assert abs(rolled) == pytest.approx(np.arctan2(0.008, 0.07), rel=1e-12)
    off = [lean(total + 1e-6 * one, robot)[0] - rolled for one in np.eye(10)]
    np.testing.assert_allclose(slope, np.array(off) / 1e-6, atol=1e-3)


def test_a_level_on_the_platform_is_an_observation() -> None:
    """One row more, with the slopes of differences; on three wires it is refused."""
    up = np.array([0.0, 0.0, 1.2])
    wires = tuple(Cable(str(k), end + up, 0.0, end) for k, end in enumerate(ENDS))
    robot = Robot("bifilar", wires, free_coordinates=("x", "y", "phi", "chi"))
    times = np.linspace(0.0, 0.5, 20)
    seen = (Signal("chi", 0.1 * np.cos(5.0 * times)),)
    cube = (Placed("cube", np.eye(3), np.array([0.0, 0.003, -0.1])),)
    run = BenchRun("a", "identify", times, seen, np.full(2, 1.2), loads=cube)
    level = replace(run, level_std_rad=0.003)
    load = (Load("cube", 0.7, 0.001, np.zeros(3), np.full(3, 0.002)),)
    rows = []
    for one in (run, level):
        start = assembled(build_model(robot, EFFECTS), Bench((one,), (), load), [one])
        values = start.unknowns.of_run(0)
        rows.append(start.swings[0].residuals(values, start.swings[0].simulated(values)))
    assert len(rows[1]) == len(rows[0]) + 1
    rolled = lean(start.swings[0].total(values), robot)[0]
    assert rows[1][-1] == pytest.approx(rolled / 0.003, rel=1e-9)
    still = free_roll.unlevelled(start.swings, {"platform": HELD})
    assert still[0].level_std_rad is None
    assert free_roll.levelled_as(still, start.swings)[0].level_std_rad == 0.003
    assert free_roll.unlevelled(start.swings, {"platform": np.arange(10) == 4}) is start.swings
    slopes_are_those_of_differences(Bench((level,), (), load), robot)
    with pytest.raises(DataError, match=r"level_std_rad .* hangs on 3"):
        identify_bench(Bench((replace(level, loads=()),)), trifilar())


@pytest.mark.parametrize(("given", "right"), [("0.003", True), ("0.0", False), ('"yes"', False)])
def test_a_level_is_read_from_the_session(tmp_path: Path, given: str, right: bool) -> None:
    text = 'format = "freeswing-session/1"\nname = "a"\nrobot = "robot.toml"\n[[runs]]\n'
    text += 'name = "r"\nrole = "identify"\ntrajectory = "r.csv"\n'
    (tmp_path / "robot.toml").touch()
    (tmp_path / "r.csv").touch()
    (tmp_path / "session.toml").write_text(text + f"level_std_rad = {given}\n")
    if right:
        assert read_session(tmp_path).runs[0].level_std_rad == 0.003
    else:
        with pytest.raises(InputError, match=r"level_std_rad"):
            read_session(tmp_path)


@pytest.mark.slow
def test_yaw_alone_on_two_wires_by_another_simulator(tmp_path: Path) -> None:
    """Izz within 1 %, and claimed as well as it is: 12 % before roll was heard."""
    truth = make_bench(tmp_path, 100, 2, "chi", weights_m=BOTH_SIDES_M, places_m=(LEVEL_M,))
    session = read_session(tmp_path)
    robot = load_robot(session)
    told = identify_bench(load_bench(session, robot, None), robot).document()
    (row,) = [p for o in told["objects"] if o["name"] == "object" for p in o["parameters"]
              if p["name"] == "Izz_kg_m2"]  # fmt: skip
    off = row["value"] - truth.load_izz
    assert abs(off) < 0.01 * truth.load_izz, row
    assert row["std"] < 0.012 * truth.load_izz, row
    assert abs(off) < 3.0 * row["std"], row
