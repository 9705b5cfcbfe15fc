"""Errors of calibrations from rendered recordings, beside what the calibrations claim.

Rigs of three cameras (800 x 640, lenses that bend) film a ChArUco board: at rest in 16 poses; waved
by hand at 60 and at 25 frames a second before free-running clocks (4.3 and -6.8 ms off), the third
camera with a rolling shutter. The normalised error squared of all lens, pose and clock unknowns,
e' C^-1 e, has to lie in its 99.8 % chi-square band; points are rms over the volume.

Usage: python benchmarks/cameras/camera_covariance.py [--seeds 4]
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import cv2  # noqa: E402, RUF100
import numpy as np
from scipy.stats import chi2

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from freeswing.calib.rig.triangulation import triangulate  # noqa: E402
from freeswing.calib.verdict.halves_and_lengths import rigidly_fitted  # noqa: E402
from tests.calib import films, rigs  # noqa: E402

KINDS = {"at rest, 16 poses": None, "waved, 60 Hz": (60.0, 100), "waved, 25 Hz": (25.0, 60)}


def calibrated(kind, seed, folder):
    """A rig and its true cameras."""
    cameras = films.small_rig(3, seed)
    filmed = KINDS[kind]
    if filmed is None:
        return films.calibrate_still(folder, cameras, 16, seed), cameras
    cameras = films.free_running(cameras)
    rate_hz, count = filmed
    return films.calibrate_moving(folder, cameras, rate_hz, count, seed).rig, cameras


def point_error_mm(found, true):
    """Rms distance over the volume after the best rigid fit, mm."""
    points = np.random.default_rng(0).uniform(-0.4, 0.4, (500, 3))
    again = triangulate(found, np.stack([c.project(c.to_camera(points)) for c in true]))
    error = again - rigidly_fitted(points, again)
    return 1e3 * float(np.sqrt(np.mean(np.sum(error**2, axis=1))))


def main() -> None:
    """Print a table and JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=4)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    print(f"{'':20s} {'e2':>8s} {'dof':>5s} {'band':>13s} {'clock ms':>9s} {'points mm':>10s}")
    results = {}
    for kind in KINDS:
        squares, freedom, clocks, points = 0.0, 0, 0.0, []
        for seed in range(options.seeds):
            with tempfile.TemporaryDirectory() as folder:
                rig, cameras = calibrated(kind, seed, Path(folder))
            square, count = rigs.error_square(rig, cameras)
            squares, freedom = squares + square, freedom + count
            pairs = zip(rig.cameras, cameras, strict=True)
            clocks = max(clocks, *(abs(a.clock_offset_s - b.clock_offset_s) for a, b in pairs))
            points.append(point_error_mm(rig.cameras, cameras))
        low, high = chi2.ppf([0.001, 0.999], freedom)
        point = float(np.sqrt(np.mean(np.square(points))))
        results[kind] = {
            "error_square": squares,
            "freedom": freedom,
            "band": [float(low), float(high)],
            "worst_clock_ms": 1e3 * clocks,
            "point_error_mm": point,
        }
        band = f"{low:.0f} - {high:.0f}"
        print(
            f"{kind:20s} {squares:8.1f} {freedom:5d} {band:>13s} {1e3 * clocks:9.4f} {point:10.4f}"
        )
    print(json.dumps(results))


if __name__ == "__main__":
    main()
