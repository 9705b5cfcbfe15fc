"""Numbers of a bench in another unit are named before a fit: both sides of each limit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.robot import Platform, Robot
from freeswing.doctor.bench_units import refuse_wrong_plan, refuse_wrong_units
from freeswing.excite.bench_plan import BenchCase
from freeswing.ident.bench.runs import Bench, BenchRun, KnownBody, Load, Signal
from tests.ident.bench.test_swing_slopes import trifilar

ROBOT = replace(trifilar(), platform=Platform(mass_kg=1.2))  # wires 0.25 m from the middle
TIMES = np.arange(100) / 50.0


def bench_of(loads: tuple[Load, ...] = (), **fields: Any) -> Bench:
    signals = (Signal("chi", 0.1 * np.sin(TIMES)),)
    run = BenchRun("a", "identify", TIMES, signals, np.full(3, 1.2))
    return Bench((replace(run, **fields),), loads=loads)


def payload(mass_kg: float, far_m: float) -> dict[str, Any]:
    return {"payloads": (KnownBody(mass_kg, np.array([far_m, 0.0, 0.0]), np.zeros(6)),)}


def turned(mass_kg: float, gyration_m: float) -> dict[str, Any]:
    inertia = mass_kg * gyration_m**2 * np.array([1.0, 0.5, 0.5, 0.0, 0.0, 0.0])
    return {"payloads": (KnownBody(mass_kg, np.zeros(3), inertia),)}


def counted(known: int) -> dict[str, Any]:
    return {"signals": (Signal("chi", np.where(np.arange(100) < known, 0.1, np.nan)),)}


def moved(column: str, over_m: float) -> dict[str, Any]:
    return {"signals": (Signal(column, np.linspace(0.0, over_m, 100)),)}


def load(mass_kg: float, far_m: float) -> dict[str, Any]:
    return {"loads": (Load("cube", mass_kg, com_m=np.array([0.0, far_m, 0.0])),)}


PENDULUM_S = 2.0 * np.pi * np.sqrt(1.2 / 9.81)


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"lengths_m": np.full(3, 12.4)}, ""),
        ({"lengths_m": np.full(3, 12.6)}, "run a: cable_lengths_m (session.toml) of 12.6 m"),
        ({"lengths_m": np.full(3, 0.026)}, ""),
        ({"lengths_m": np.full(3, 0.024)}, "run a: cable_lengths_m (session.toml) of 0.024 m"),
        ({"lengths_m": None}, ""),
        (payload(239.0, 0.1), ""),
        (payload(241.0, 0.1), "run a: payload mass_kg = 241 kg"),
        (payload(0.4, 2.4), ""),
        (payload(0.4, 2.6), "run a: payload position_m is 2.6 m"),
        (turned(0.4, 2.4), ""),
        (turned(0.4, 2.6), "run a: payload inertia_kg_m2 of 0.4 kg is a radius of gyration of 2.6"),
        (load(241.0, 0.1), "loads cube: mass_kg = 241 kg"),
        (load(0.4, 2.6), "loads cube: com_m is 2.6 m"),
        ({"lengths_std_m": 0.059}, ""),
        ({"lengths_std_m": 0.061}, "run a: cable_lengths_std_m = 0.061 m on wires of 1.2 m"),
        (moved("x", 2.3), ""),
        (moved("x", 2.5), "run a: column x_m goes over 2.5 m"),
        (moved("dot_px", 1e3), ""),
        ({"times_s": 0.24 * PENDULUM_S * np.arange(100.0)}, ""),
        ({"times_s": 0.26 * PENDULUM_S * np.arange(100.0)}, "run a: column t_s: samples are"),
        ({"times_s": TIMES[:2]}, ""),
        (payload(0.0012, 0.1) | {"name": "a"}, ""),
        (payload(0.00119, 0.1), "platform mass_kg (robot.toml) = 1.2 kg, and the heaviest"),
    ],
)
def test_what_can_only_be_another_unit(fields: dict[str, Any], says: str) -> None:
    bench = bench_of(**fields)
    if not says:
        refuse_wrong_units(bench, ROBOT)
        return
    with pytest.raises(InputError, match="write m, kg, s and rad") as told:
        refuse_wrong_units(bench, ROBOT)
    assert says in str(told.value)


@pytest.mark.parametrize(("known", "refused"), [(0, True), (19, True), (20, False)])
def test_a_column_that_holds_next_to_nothing(known: int, refused: bool) -> None:
    if not refused:
        refuse_wrong_units(bench_of(**counted(known)), ROBOT)
        return
    with pytest.raises(InputError, match=f"run a: the column of chi holds {known} number"):
        refuse_wrong_units(bench_of(**counted(known)), ROBOT)


def risen(entries_z_m: float, z_m: float | None = None, up: float = 1.0) -> tuple[Bench, Robot]:
    """A bench whose wires end at some height; where z is measured, and which way is up."""
    ends = [
        replace(c, entry_m=c.entry_m * [1.0, 1.0, 0.0] + [0.0, 0.0, entries_z_m])
        for c in ROBOT.cables
    ]
    robot = replace(ROBOT, cables=tuple(ends), gravity_m_s2=np.array([0.0, 0.0, -9.81 * up]))
    seen: dict[str, Any] = {} if z_m is None else {"signals": (Signal("z", np.full(100, z_m)),)}
    return bench_of(**seen), robot


@pytest.mark.parametrize(
    ("bench", "refused"),
    [
        (risen(1.2), False),
        (risen(1.2, up=-1.0), True),
        (risen(-1.2, up=-1.0), False),  # z down
        (risen(0.0, up=-1.0), False),  # the frame hangs at the ceiling, z down
        (risen(-0.59), False),
        (risen(-0.61), True),
        (risen(-0.7, z_m=-1.9), False),
        (risen(0.0, z_m=1.2, up=1.0), True),
        (risen(0.0, z_m=1.2, up=-1.0), False),
    ],
)
def test_gravity_that_points_upwards(bench: tuple[Bench, Robot], refused: bool) -> None:
    if not refused:
        refuse_wrong_units(*bench)
        return
    with pytest.raises(InputError, match=r"robot.toml: gravity_m_s2 = .* turn its sign"):
        refuse_wrong_units(*bench)


def test_many_are_counted() -> None:
    bench = bench_of(lengths_m=np.full(3, 120.0))
    with pytest.raises(InputError, match="and 2 more: write"):
        refuse_wrong_units(replace(bench, runs=bench.runs * 5), ROBOT)


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"known_kg": 239.0}, ""),
        ({"known_kg": 241.0}, "--known-kg 241 on a platform of 1.2 kg"),
        ({"load_kg": 0.00121, "load_izz_kg_m2": 1e-5}, ""),
        ({"load_kg": 0.00119, "load_izz_kg_m2": 1e-5}, "--load-kg 0.00119 on"),
        ({"load_izz_kg_m2": 0.8 * 2.4**2}, ""),
        ({"load_izz_kg_m2": 0.8 * 2.6**2}, "gyration of 2.6 m"),
    ],
)
def test_a_plan_in_other_units(fields: dict[str, float], says: str) -> None:
    case = replace(BenchCase(1.2, 0.04, 0.8, 0.0093, 0.25, 1.2, 0.4), **fields)
    if not says:
        refuse_wrong_plan(case)
        return
    with pytest.raises(InputError, match="write kg and kg m2") as told:
        refuse_wrong_plan(case)
    assert says in str(told.value)
