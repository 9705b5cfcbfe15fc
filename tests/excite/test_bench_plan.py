"""A bench's plan: its bound is that of a fitted sine, its shares add up, its advice is known."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.simulation.parallel_wires import bending
from freeswing.excite.bench_plan import (
    BenchCase,
    _frequencies,
    deviations,
    frequency_std,
    planned,
)
from freeswing.main import main

CASE = BenchCase(1.26, 0.04, 0.8, 0.0093, 0.25, 1.2, 0.4)


def test_a_frequencys_bound_is_that_of_rife_and_boorstyn() -> None:
    """Without decay, many samples: var = 24 sigma^2 / (A^2 N T^2)."""
    case = replace(CASE, decay_1_s=0.0, duration_s=40.0)
    count, amplitude = 40.0 * case.rate_hz, np.deg2rad(case.twist_deg)
    expected = case.noise_rad * np.sqrt(24.0 / count) / (amplitude * 40.0)
    assert frequency_std(case, 6.0) == pytest.approx(expected, rel=0.02)


def test_the_deviation_is_that_of_many_recorded_sessions() -> None:
    """Masses, radii, wires and frequencies drawn as believed; the object by weighted least squares.

    With exact radii, wires, clock and centre of mass the object follows in closed form from the
    empty and the loaded frequency and the weighed masses.
    """
    exact = {"radius_std_m": 0.0, "length_std_m": 0.0, "clock_std": 0.0, "com_std_m": 0.0}
    case = replace(CASE, **exact, known_kg=1e-9, mass_std_kg=0.004, rehanging=2e-4)
    rng = np.random.default_rng(3)
    empty, _, loaded = _frequencies(case, np.zeros(8))
    own = case.izz_kg_m2 / case.mass_kg
    both = (case.izz_kg_m2 + case.load_izz_kg_m2) / (case.mass_kg + case.load_kg)
    square = np.deg2rad(case.twist_deg) ** 2
    growth = [1.0 + square * bending(0.25, 0.25, case.length_m, one) for one in (own, both)]
    found = []
    for _ in range(4000):
        mass = case.mass_kg + case.mass_std_kg * rng.normal()
        added = case.load_kg + case.load_std_kg * rng.normal()
        seen = []
        for omega, grown in zip((empty, loaded), growth, strict=True):
            spread = np.hypot(frequency_std(case, omega), 0.5 * case.rehanging * omega)
            seen.append((omega + spread / np.sqrt(case.runs) * rng.normal()) / grown)
        group = 9.80665 * case.radius_m**2 / case.length_m
        found.append(group * ((mass + added) / seen[1] ** 2 - mass / seen[0] ** 2))
    assert np.mean(found) == pytest.approx(case.load_izz_kg_m2, rel=2e-3)
    assert deviations(case)["total"] == pytest.approx(np.std(found), rel=0.06)


def test_a_known_mass_at_the_radius_of_gyration_tells_nothing() -> None:
    """There it changes mass and inertia alike, and the period not at all."""
    gyration = np.sqrt(CASE.izz_kg_m2 / CASE.mass_kg) / CASE.radius_m
    there = deviations(replace(CASE, known_at=float(gyration)))["total"]
    for elsewhere in (0.5 * gyration, 1.4 * gyration):
        assert deviations(replace(CASE, known_at=float(elsewhere)))["total"] < 0.5 * there


def test_a_plan_is_hardly_worse_than_any_single_change_and_no_larger_than_need_be() -> None:
    best, rows = planned(CASE, ("radius",))
    assert best.radius == CASE.radius
    chosen = 100.0 * deviations(best)["total"] / CASE.load_izz_kg_m2
    assert [row.percent for row in rows if row.best] == pytest.approx([chosen] * 5)
    assert min(row.percent for row in rows) > chosen / 1.021
    times = [row for row in rows if row.what == "duration_s"]
    assert times[0].best, "ten seconds do where rehanging scatters ten times more than samples"


def test_an_uncalibrated_signal_asks_for_small_twists() -> None:
    """Its amplitude is not known, and the period depends on it."""
    loose = replace(CASE, gain_std=0.5, known_kg=1e-9, mass_std_kg=1e-4, rehanging=1e-4)
    wide, narrow = (deviations(replace(loose, twist_deg=turn)) for turn in (12.0, 2.0))
    assert wide["amplitude"] > 20.0 * narrow["amplitude"]
    assert planned(loose)[0].twist_deg < 12.0


ROBOT = """format = "freeswing-robot/1"
name = "plate"
free_coordinates = ["x", "y", "chi"]
[platform]
mass_kg = 1.2
[[cables]]
name = "1"
entry_m = [0.25, 0.0, 1.2]
pulley_radius_m = 0.0
attachment_m = [0.25, 0.0, 0.0]
[[cables]]
name = "2"
entry_m = [-0.125, 0.2165, 1.2]
pulley_radius_m = 0.0
attachment_m = [-0.125, 0.2165, 0.0]
[[cables]]
name = "3"
entry_m = [-0.125, -0.2165, 1.2]
pulley_radius_m = 0.0
attachment_m = [-0.125, -0.2165, 0.0]
"""


def test_excite_plans_a_bench(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot = tmp_path / "robot.toml"
    robot.write_text(ROBOT)
    asked = ["--load-kg", "0.8", "--load-izz-kg-m2", "0.0093", "--keep", "length_m", "radius"]
    assert main(["excite", str(robot), *asked]) == 0
    told = json.loads((tmp_path / "results" / "bench-plan.json").read_text())
    assert told["format"] == "freeswing-bench-plan/1"
    assert {row["what"] for row in told["choices"] if row["best"]} >= {"known_at", "twist_deg"}
    said = capsys.readouterr().out
    assert f"what remains of {told['percent']:.2f} %" in said


def test_a_bench_without_a_mass_is_told_to_be_weighed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = tmp_path / "robot.toml"
    robot.write_text(ROBOT.replace("mass_kg = 1.2\n", ""))
    assert main(["excite", str(robot)]) == 1
    assert "weigh it" in capsys.readouterr().err
