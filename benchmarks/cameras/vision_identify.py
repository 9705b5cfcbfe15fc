"""Rendered sessions through calibrate, track and identify: inertia against truth.

Three 640 x 480 cameras film swings of the paper's robot without any undeclared effect; every seed
has its own releases, sensor noise and errors of the stated lengths. Told are the errors in claimed
standard deviations, with the cameras' calibration among the unknowns and, as a control, without.

    python benchmarks/cameras/vision_identify.py [--seeds 4] [--folder DIR]
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from freeswing.cdpr.robot import INERTIA_NAMES
from freeswing.demo.filmed import write_filmed_session
from freeswing.main import main as freeswing
from freeswing.session.session_file import read_session

NO_DRAG = (0.0, 0.6)


def session_of(folder: Path, seed: int) -> Path:
    """A filmed, calibrated and tracked session; what is there already is not made again."""
    place = folder / f"seed-{seed}"
    if not (place / "session.toml").is_file():
        write_filmed_session(place, seed, effect_values=NO_DRAG)
    for command, result in (("calibrate", "calibration.json"), ("track", "tracking.json")):
        if not (place / "results" / result).is_file():
            status = freeswing([command, str(place), "--quiet"])
            if status:
                raise SystemExit(f"freeswing {command}: exit status {status}")
    return place


def identified(place: Path) -> dict[str, dict]:
    """Errors and their claims, by estimate."""
    status = freeswing(["identify", str(place), "--quiet"])
    if status:
        raise SystemExit(f"freeswing identify: exit status {status}")
    results = read_session(place).results
    document = json.loads((results / "identification.json").read_text())
    truth = json.loads((place / "truth.json").read_text())["parameters"]
    found = {}
    for name, estimate in document["estimates"].items():
        rows = [p for p in estimate["parameters"] if p["name"] in INERTIA_NAMES]
        error = np.array([p["value"] - truth[p["name"]] for p in rows])
        z = error / np.array([p["std"] for p in rows])
        essential = np.array([p["essential"] for p in rows])
        found[name] = {
            "error": error.tolist(),
            "z": z.tolist(),
            "worst_essential_z": float(np.abs(z[essential]).max()),
        }
    return found


def without_modes(place: Path) -> dict[str, dict]:
    """The control: the same tracks where nothing is known of the calibration's errors."""
    path = read_session(place).results / "tracking.json"
    whole = path.read_text()
    document = json.loads(whole)
    for run in document["runs"]:
        run["calibration_errors"] = None
    try:
        path.write_text(json.dumps(document))
        return identified(place)
    finally:
        path.write_text(whole)


def main() -> None:
    """Films, calibrates, tracks, identifies and prints."""
    parser = argparse.ArgumentParser(description="Rendered sessions to inertia, against truth.")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--folder", type=Path)
    options = parser.parse_args()
    folder = options.folder or Path(tempfile.mkdtemp())
    rows = []
    for seed in range(1, options.seeds + 1):
        place = session_of(folder, seed)
        for kind, found in (("left out", without_modes(place)), ("known", identified(place))):
            for name, one in found.items():
                rows.append({"seed": seed, "calibration": kind, "estimate": name, **one})
                print(
                    f"seed {seed} calibration {kind:8s} {name:10s} com_z off by "
                    f"{1e6 * one['error'][2]:9.2f} um, worst essential parameter "
                    f"{one['worst_essential_z']:5.1f} claimed deviations"
                )
    for kind in ("left out", "known"):
        for name in ("ml_full", "ml_free"):
            mine = [r["z"] for r in rows if (r["calibration"], r["estimate"]) == (kind, name)]
            rms = float(np.sqrt(np.mean(np.square(mine))))
            print(f"calibration {kind:8s} {name}: errors {rms:.2f} claimed deviations rms")
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
