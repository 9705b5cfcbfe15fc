"""An object's whole tensor from three orientations on two wires: errors and claimed deviations.

Benches of the independent simulator, two empty runs and two of each orientation, poses of 0.1 mm
and 0.5 mrad. Prints each entry's error as a share of the largest moment, and a JSON line.

    python benchmarks/identify/turned_load.py --seeds 5
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from freeswing.main import main as freeswing
from tests.oracle.recorded.turned_benches import make_turned_bench

ENTRIES = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


def entries_of(seed: int, duration_s: float) -> tuple[list[float], list[float]]:
    """Errors of the six entries in per cent of the largest moment, and in deviations."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truth = make_turned_bench(folder, seed, duration_s)
        if freeswing(["identify", str(folder), "--quiet"]) != 0:
            raise SystemExit(f"seed {seed}: identify failed")
        told = json.loads((folder / "results" / "identification.json").read_text("utf-8"))
    rows = {row["name"]: row for row in told["objects"][1]["parameters"]}
    largest = float(np.max(np.linalg.eigvalsh(truth.tensor_kg_m2)))
    off = {
        entry: rows[f"I{entry}_kg_m2"]["value"] - truth.tensor_kg_m2[place]
        for entry, place in ENTRIES.items()
    }
    percent = [100.0 * one / largest for one in off.values()]
    return percent, [one / rows[f"I{entry}_kg_m2"]["std"] for entry, one in off.items()]


def main() -> None:
    """Run all seeds."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--duration-s", type=float, default=10.0)
    options = parser.parse_args()
    began, every, deviations = time.process_time(), [], []
    print("seed  " + "  ".join(f"I{entry:6}" for entry in ENTRIES) + "  (% of the largest moment)")
    for seed in range(options.seeds):
        percent, z = entries_of(seed, options.duration_s)
        every.append(percent)
        deviations.append(z)
        print(f"{seed:4}  " + "  ".join(f"{one:+7.3f}" for one in percent))
    found = {
        "worst_percent": float(np.abs(every).max()),
        "worst_deviations": float(np.abs(deviations).max()),
        "within_95_percent": float(np.mean(np.abs(deviations) < 1.96)),
        "processor_s": time.process_time() - began,
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
