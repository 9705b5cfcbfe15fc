"""Numbers of a bench that can only be in another unit: no swing shows it, and results hang on it.

Yaw alone tells inertia over wire length: with lengths in cm Izz came out a hundredth, and sure.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.robot import Robot, spread_of
from freeswing.excite.bench_plan import BenchCase
from freeswing.ident.bench.runs import Bench, BenchRun, Signal

LONGEST = 50.0  # wires over their distance from the middle: 12 m at 0.25 m
SHORTEST = 0.1  # the same: 25 mm at 0.25 m
FARTHEST = 10.0  # a known mass, or an object's centre, over the wires' distance from the middle
HEAVIEST = 200.0  # what lies on a platform over the platform
LIGHTEST = 1000.0  # a platform over the heaviest that lies on it, of which no swing shows more
LOOSEST = 0.05  # of the wires' length: what it may be off by; a step's length is wrong by less
BENEATH = 0.5  # of it: how far upper ends may lie under P, where a frame hangs at the ceiling
WIDEST = 2.0  # a platform's motion over its wires' length: it goes round
FEWEST = 20  # samples: two swings of ten, from which a start and its rates can be told
SLOWEST = 0.25  # of a pendulum's period between samples: yaw may be four times as fast


def refuse_wrong_units(bench: Bench, robot: Robot) -> None:
    """Refuse lengths, masses, places, positions and times that must be in another unit.

    And gravity that would have the platform stand on its wires.

    Raises:
        InputError: naming run, key or column, number and what it is held against.
    """
    radius = spread_of(robot.attachments_m)
    _refuse_too_few(bench)
    _refuse_upside_down(bench, robot)
    told = [*_of_loads(bench, robot, radius), *_of_platform(bench, robot)]
    for run in bench.runs:
        told += [f"run {run.name}: {one}" for one in _of_run(run, robot, radius)]
    if told:
        more = f"; and {len(told) - 3} more" if len(told) > 3 else ""
        raise InputError(f"{'; '.join(told[:3])}{more}: write m, kg, s and rad")


def refuse_wrong_plan(case: BenchCase) -> None:
    """Refuse masses and an inertia of a plan that must be in another unit.

    Raises:
        InputError: naming the option or key, the number and what it is held against.
    """
    told = []
    for what, mass in (("--load-kg", case.load_kg), ("--known-kg", case.known_kg)):
        if mass > HEAVIEST * case.mass_kg or case.mass_kg > LIGHTEST * mass:
            told.append(f"{what} {mass:.4g} on a platform of {case.mass_kg:.4g} kg")
    gyration = float(np.sqrt(case.load_izz_kg_m2 / case.load_kg))
    if gyration > FARTHEST * case.radius_m:
        told.append(
            f"--load-izz-kg-m2 {case.load_izz_kg_m2:.4g} of {case.load_kg:.4g} kg is a radius of "
            f"gyration of {gyration:.3g} m, on wires {case.radius_m:.3g} m from their middle"
        )
    if told:
        raise InputError(f"{'; '.join(told)}: write kg and kg m2")


def _refuse_too_few(bench: Bench) -> None:
    """Refuse columns that hold next to no numbers.

    Raises:
        InputError: naming run, column and count.
    """
    for run in bench.runs:
        for signal in run.signals:
            known = int(np.isfinite(signal.values).sum())
            if known < FEWEST:
                raise InputError(
                    f"run {run.name}: the column of {signal.column} holds {known} number(s), "
                    f"{FEWEST} are needed: record the swing, or leave the column out"
                )


def _refuse_upside_down(bench: Bench, robot: Robot) -> None:
    """Refuse gravity that points from the platform to its wires' upper ends: yaw shows no sign.

    Raises:
        InputError: naming gravity_m_s2, and how far the ends lie on the wrong side.
    """
    up = -robot.gravity_m_s2 / np.linalg.norm(robot.gravity_m_s2)
    for run in bench.runs:
        if run.lengths_m is None:
            continue
        heights = [float(np.nanmean(s.values)) for s in run.signals if s.column == "z"]
        p_m = up[2] * heights[0] if heights else 0.0
        below = p_m - float(np.mean(robot.entries_m @ up))
        if below > BENEATH * float(np.mean(run.lengths_m)):
            raise InputError(
                f"robot.toml: gravity_m_s2 = {robot.gravity_m_s2.tolist()} pulls towards the "
                f"wires' upper ends (entry_m), which lie {below:.4g} m below P: the platform would "
                "stand on its wires; turn its sign, or put the base frame's origin beneath entry_m"
            )


def _of_loads(bench: Bench, robot: Robot, radius_m: float) -> Iterator[str]:
    for load in bench.loads:
        yield from _of_mass(f"loads {load.name}: mass_kg", load.mass_kg, robot)
        if load.com_m is not None:
            yield from _of_place(f"loads {load.name}: com_m", load.com_m, radius_m)


def _of_platform(bench: Bench, robot: Robot) -> Iterator[str]:
    masses = [load.mass_kg for load in bench.loads]
    masses += [payload.mass_kg for run in bench.runs for payload in run.payloads]
    platform = robot.platform.mass_kg
    if platform is not None and masses and platform > LIGHTEST * max(masses):
        yield (
            f"platform mass_kg (robot.toml) = {platform:.4g} kg, and the heaviest on it has "
            f"{max(masses):.4g} kg: is it in g?"
        )


def _of_run(run: BenchRun, robot: Robot, radius_m: float) -> Iterator[str]:
    for payload in run.payloads:
        yield from _of_mass("payload mass_kg", payload.mass_kg, robot)
        yield from _of_place("payload position_m", payload.position_m, radius_m)
        gyration = float(np.sqrt(0.5 * abs(payload.inertia_kg_m2[:3].sum()) / payload.mass_kg))
        if gyration > FARTHEST * radius_m > 0.0:
            yield (
                f"payload inertia_kg_m2 of {payload.mass_kg:.4g} kg is a radius of gyration of "
                f"{gyration:.3g} m, the wires {radius_m:.4g} m from their middle: in kg mm²?"
            )
    if run.lengths_m is None or not radius_m > 0.0:
        return
    length = float(np.mean(run.lengths_m))
    if not SHORTEST * radius_m <= length <= LONGEST * radius_m:
        yield (
            f"cable_lengths_m (session.toml) of {length:.4g} m on wires whose attachment_m "
            f"(robot.toml) lie {radius_m:.4g} m from their middle: one of them is in another unit"
        )
        return
    if run.lengths_std_m is not None and run.lengths_std_m > LOOSEST * length:
        yield (
            f"cable_lengths_std_m = {run.lengths_std_m:.4g} m on wires of {length:.4g} m: is it in "
            "mm? A tape is right to a millimetre or two"
        )
    for signal in run.signals:
        yield from _of_positions(signal, length)
    yield from _of_times(run, length, float(np.linalg.norm(robot.gravity_m_s2)))


def _of_mass(what: str, mass_kg: float, robot: Robot) -> Iterator[str]:
    platform = robot.platform.mass_kg
    if platform is not None and mass_kg > HEAVIEST * platform:
        yield f"{what} = {mass_kg:.4g} kg on a platform of {platform:.4g} kg: is it in g?"


def _of_place(what: str, place_m: np.ndarray, radius_m: float) -> Iterator[str]:
    far = float(np.linalg.norm(place_m))
    if far > FARTHEST * radius_m > 0.0:
        yield f"{what} is {far:.4g} m from P, the wires {radius_m:.4g} m from their middle: in mm?"


def _of_positions(signal: Signal, length_m: float) -> Iterator[str]:
    known = signal.values[np.isfinite(signal.values)]
    if signal.column in ("x", "y", "z") and len(known) and np.ptp(known) > WIDEST * length_m:
        yield (
            f"column {signal.column}_m goes over {float(np.ptp(known)):.4g} m, on wires of "
            f"{length_m:.4g} m: is it in mm?"
        )


def _of_times(run: BenchRun, length_m: float, gravity_m_s2: float) -> Iterator[str]:
    if len(run.times_s) < 3:
        return
    apart = float(np.median(np.diff(run.times_s)))
    period = 2.0 * np.pi * float(np.sqrt(length_m / gravity_m_s2))
    if apart > SLOWEST * period:
        yield (
            f"column t_s: samples are {apart:.4g} s apart, and wires of {length_m:.4g} m sway in "
            f"{period:.2g} s: is it in ms, or were samples left out?"
        )
