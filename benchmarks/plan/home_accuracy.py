"""Homing on the paper's 3-cable robot: exactness, time and memory, and errors beside the paper's.

Run: python benchmarks/plan/home_accuracy.py [--runs 200]. Prints a table and a line of JSON.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from freeswing.homing.home import find_start
from freeswing.homing.homing_files import GeometryNoise, Homing, ReadingNoise, Readings
from freeswing.homing.simulated_acquisition import PERFECT, AcquisitionErrors, simulate_acquisition
from tests.paper_robots import LARGEST_N, PERTURBED_N, START_N, bologna_3

PAPER_ERRORS_MM = (5.7, 9.9, 11.5, 13.4, 23.4)


def acquired(robot, n_poses, errors, seed):
    """Readings and truth."""
    made = simulate_acquisition(
        robot, START_N, LARGEST_N, n_poses, errors, np.random.default_rng(seed)
    )
    return Readings(made.readings.sigma_rad, made.readings.length_m), made


def exact(count: int) -> dict:
    """Ideal readings from the paper's perturbed guess."""
    robot = bologna_3()
    readings, made = acquired(robot, count + 1, PERFECT, 0)
    homing = Homing(robot, readings, PERTURBED_N, LARGEST_N, ReadingNoise(stated=True))
    fits, seconds = [], []
    for _ in range(5 if count < 1000 else 2):
        begun = time.process_time()
        fits.append(find_start(homing))
        seconds.append(time.process_time() - begun)
    return {
        "lambda": count,
        "error": float(np.abs(fits[-1].poses[0] - made.poses[0]).max()),
        "best_ms": 1e3 * min(seconds),
        "worst_ms": 1e3 * max(seconds),
        "peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def displaced(robot, rng, noise: GeometryNoise):
    """The robot with a geometry that differs from the declared one."""
    cables = tuple(
        replace(
            c,
            entry_m=c.entry_m + noise.entry_m * rng.standard_normal(3),
            attachment_m=c.attachment_m + noise.attachment_m * rng.standard_normal(3),
            pulley_radius_m=c.pulley_radius_m + noise.radius_m * rng.standard_normal(),
        )
        for c in robot.cables
    )
    com = robot.platform.com_m + noise.com_m * rng.standard_normal(3)
    return replace(robot, cables=cables, platform=replace(robot.platform, com_m=com))


def errors_of(runs: int, errors: AcquisitionErrors, geometry: GeometryNoise | None) -> dict:
    """Monte Carlo errors beside the covariance."""
    robot, stated = (
        bologna_3(),
        ReadingNoise(
            max(errors.sigma_std_rad, 1e-7), errors.length_std_m, errors.statics, stated=True
        ),
    )
    found, claimed, squares = [], [], []
    for seed in range(runs):
        rng = np.random.default_rng(10_000 + seed)
        true = robot if geometry is None else displaced(robot, rng, geometry)
        readings, made = acquired(true, 61, errors, seed)
        fit = find_start(Homing(robot, readings, START_N, LARGEST_N, stated, geometry))
        error = fit.poses[0] - made.poses[0]
        found.append(error)
        claimed.append(np.diag(fit.pose_covariance))
        squares.append(error @ np.linalg.solve(fit.pose_covariance, error))
    found, claimed = np.array(found), np.array(claimed)
    norms = 1e3 * np.linalg.norm(found[:, :3], axis=1)
    return {
        "runs": runs,
        "position_rms_mm": float(np.sqrt((norms**2).mean())),
        "position_claimed_mm": float(1e3 * np.sqrt(claimed[:, :3].sum(axis=1).mean())),
        "position_worst_mm": float(norms.max()),
        "angle_rms_deg": float(np.degrees(np.sqrt((found[:, 3:] ** 2).sum(axis=1).mean()))),
        "square_over_degrees": float(np.mean(squares) / 6),
        "within_95_percent": float(np.mean(np.array(squares) < 12.592)),
    }


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=200)
    runs = parser.parse_args().runs
    print("ideal readings, guess from the paper's perturbed tensions")
    print(f"{'lambda':>8} {'error':>9} {'cpu ms':>9} {'worst':>9} {'peak MiB':>9}")
    ideal = [exact(count) for count in (12, 60, 120, 372, 10_000)]
    for row in ideal:
        print(
            f"{row['lambda']:8d} {row['error']:9.1e} {row['best_ms']:9.1f} "
            f"{row['worst_ms']:9.1f} {row['peak_mib']:9.0f}"
        )
    counted = AcquisitionErrors(statics=1e-6)
    cases = {
        "16-bit swivels, 0.5 mm": errors_of(runs, counted, None),
        "... and 0.1 mm of moment": errors_of(runs, AcquisitionErrors(), None),
        "... and geometry off by 2 mm": errors_of(
            max(runs // 4, 10), AcquisitionErrors(), GeometryNoise()
        ),
    }
    print(f"\nlambda = 60; the paper's five experiments: {PAPER_ERRORS_MM} mm")
    for name, row in cases.items():
        print(
            f"{name:30s} rms {row['position_rms_mm']:.2f} mm, claimed "
            f"{row['position_claimed_mm']:.2f} mm, worst {row['position_worst_mm']:.2f} mm, "
            f"{row['angle_rms_deg']:.3f} deg, chi2/6 {row['square_over_degrees']:.2f}, "
            f"in 95 %: {100 * row['within_95_percent']:.0f} %"
        )
    print(json.dumps({"ideal": ideal, "noisy": cases}))


if __name__ == "__main__":
    main()
