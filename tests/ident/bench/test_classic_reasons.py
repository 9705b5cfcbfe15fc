"""By how much the classic formula is wrong on a bench, and why: against closed forms and energy."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import Array, Robot
from freeswing.ident.bench.assemble import EFFECTS
from freeswing.ident.bench.told.classic_formula import ClassicRun
from freeswing.ident.bench.told.classic_reasons import (
    AMPLITUDE,
    BESIDE,
    LEAN,
    LEFT,
    MASS,
    ROLLS,
    UNEQUAL,
    yaw_period,
)
from freeswing.main import main
from freeswing.report.bench_words import classic_why
from freeswing.results.identification import ClassicReason, ClassicRow
from tests.ident.bench.test_swing_slopes import trifilar
from tests.oracle.recorded.benches import Hidden, make_bench

GRAVITY, LENGTH_M, RADIUS_M = 9.80665, 1.2, 0.25
BODY = np.array([0.0, 0.0, -0.05, 0.02, 0.02, 0.032, 0.0, 0.0, 0.0])  # specific, about P


def period(robot: Robot, body: Array, lengths_m: Array) -> float:
    model = build_model(robot, EFFECTS)
    return yaw_period(model, lengths_m, np.zeros(6), body)


def test_a_centred_bench_is_the_formula_s() -> None:
    found = period(trifilar(), BODY, np.full(3, LENGTH_M))
    formula = 2.0 * np.pi * np.sqrt(BODY[5] * LENGTH_M / GRAVITY) / RADIUS_M
    assert found == pytest.approx(formula, rel=1e-7)


@pytest.mark.parametrize("beside_m", [0.01, 0.03, 0.06])
def test_a_centre_of_mass_beside_the_middle(beside_m: float) -> None:
    """Yaw turns about it: less inertia by c^2, and less of the wires' spring by c^2 / R^2."""
    robot, wires = trifilar(), np.full(3, LENGTH_M)
    beside = BODY + np.array([beside_m, *np.zeros(8)])
    share = (period(robot, beside, wires) / period(robot, BODY, wires)) ** 2
    inertia, spring = 1.0 - beside_m**2 / BODY[5], 1.0 - beside_m**2 / RADIUS_M**2
    assert share == pytest.approx(inertia / spring, rel=1e-6)


def test_wires_that_lean() -> None:
    """Radii of 0.2 and 0.25 m: the spring goes with their height, not with their length."""
    robot = trifilar()
    nearer = [
        replace(cable, attachment_m=0.8 * np.asarray(cable.attachment_m)) for cable in robot.cables
    ]
    robot = Robot("leaning", tuple(nearer))
    height = np.sqrt(LENGTH_M**2 - (0.2 * RADIUS_M) ** 2)
    formula = 4.0 * np.pi**2 * BODY[5] * LENGTH_M / (GRAVITY * 0.8 * RADIUS_M**2)
    found = period(robot, BODY, np.full(3, LENGTH_M)) ** 2
    assert found / formula == pytest.approx(height / LENGTH_M, rel=1e-6)


def row(*shares: float) -> ClassicRow:
    reasons = [ClassicReason(what=f"reason {k}", percent=share) for k, share in enumerate(shares)]
    return ClassicRow(run="a", reasons=tuple(reasons))


def test_the_largest_share_is_told_first_and_nothings_are_not() -> None:
    assert classic_why(row(0.004, -2.0, 0.4)) == "reason 1 -2.00 %; reason 2 +0.40 %"
    assert classic_why(row(0.004, -0.009)) == "no share of 0.01 % or more"


def classic_of(folder: Path) -> list[dict[str, Any]]:
    assert main(["identify", str(folder)]) == 0
    told = json.loads((folder / "results" / "identification.json").read_text())
    for one in told["classic"]:
        product = np.prod([1.0 + 0.01 * share["percent"] for share in one["reasons"]])
        assert product == pytest.approx(1.0 + 0.01 * one["off_percent"], rel=1e-9), one
    return told["classic"]


def shares(one: dict[str, Any]) -> dict[str, float]:
    return {reason["what"]: reason["percent"] for reason in one["reasons"]}


def by_energy(amplitude_rad: float, radius_m: float, specific_izz: float) -> float:
    """Squared period of the pure twist over that of small ones (Landau, Lifshitz, sec. 28)."""
    product = radius_m**2

    def depth(angle: float) -> float:
        return float(np.sqrt(LENGTH_M**2 - 2.0 * product * (1.0 - np.cos(angle))))

    def quarter(phase: float) -> float:  # chi = A sin(phase): no pole at the turning point
        angle = amplitude_rad * np.sin(phase)
        inertia = specific_izz + (product * np.sin(angle) / depth(angle)) ** 2
        fall = 2.0 * GRAVITY * (depth(angle) - depth(amplitude_rad))
        return float(np.sqrt(inertia / fall) * amplitude_rad * np.cos(phase))

    exact = 4.0 * quad(quarter, 0.0, np.pi / 2.0 - 1e-9)[0]
    small = 2.0 * np.pi * np.sqrt(specific_izz * LENGTH_M / (GRAVITY * product))
    return float((exact / small) ** 2)


@pytest.mark.slow
@pytest.mark.parametrize(("wires", "radius_m"), [(3, 0.25), (2, 0.2)])
def test_large_angles(tmp_path: Path, wires: int, radius_m: float) -> None:
    """Twisted by 33 degrees or more: what energy says of the period is what the report says."""
    hidden = Hidden(0.0, 1.0, 0.0, 0.0, wider=4.3)
    truth = make_bench(tmp_path, 3, wires, "poses", 8.0, (2, 1, 1), hidden)
    for one in classic_of(tmp_path)[:2]:
        chi = np.genfromtxt(tmp_path / "runs" / f"{one['run']}.csv", delimiter=",", names=True)
        amplitude = 0.5 * float(np.ptp(chi["chi_rad"]))
        assert amplitude > 0.55, amplitude
        said = shares(one)
        expected = by_energy(amplitude, radius_m, truth.platform_izz_p / truth.platform_kg)
        assert said[AMPLITUDE] == pytest.approx(100.0 * (expected - 1.0), abs=0.4), (said, expected)
        assert said[AMPLITUDE] > 4.0, said
        assert abs(one["off_percent"] - said[AMPLITUDE]) < 0.3, one


@pytest.mark.slow
@pytest.mark.parametrize("wires", [2, 3])
def test_each_reason_is_named_with_its_share(tmp_path: Path, wires: int) -> None:
    """A centre of mass 27 mm beside the middle, a platform 5 % heavier, a wire of 1.23 m."""
    hidden = Hidden(0.03, 1.05, 0.0, 0.0, beside_m=(0.027, 0.0, 0.0))
    make_bench(tmp_path, 3, wires, "poses", 8.0, (2, 1, 1), hidden)
    path = tmp_path / "session.toml"
    path.write_text(path.read_text().replace("= [1.2, 1.2", "= [1.23, 1.2"))
    for one in classic_of(tmp_path):
        said = shares(one)
        carried = 1.26 + {"weight": 0.4, "loaded": 0.8}.get(one["run"].split("-")[0], 0.0)
        assert said[MASS] == pytest.approx(-100.0 * 0.06 / carried, abs=0.6), said
        assert said[BESIDE] < -0.3, said
        assert abs(said[UNEQUAL]) > 0.05, said
        assert abs(said[LEAN]) < 0.01, said
        assert abs(said[ROLLS]) < 1.0, said
        assert abs(said[LEFT]) < 0.15, said


def test_off_percent_is_of_the_fit() -> None:
    assert ClassicRun("a", 1.0, 1.1, 1.0, ()).off_percent == pytest.approx(10.0)
