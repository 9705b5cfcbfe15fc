"""An object's whole tensor from three orientations: errors and claimed deviations.

Benches of the independent simulator, two empty runs and two of each orientation, poses of 0.1 mm
and 0.5 mrad. Prints each entry's error and claimed deviation as shares of the largest moment, and
a JSON line.

    python benchmarks/identify/turned_load.py --seeds 5
    python benchmarks/identify/turned_load.py --seeds 5 --wires 3
    python benchmarks/identify/turned_load.py --seeds 5 --wires 3 --six-ways

Three wires show products by how they tilt the platform where sway and yaw meet, so it is twisted by
20 degrees and pushed aside by 7 cm; with `--six-ways` twists by hand do.
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
from tests.oracle.recorded.benches import UNWANTED_M_S
from tests.oracle.recorded.turned_benches import LAID, WAYS, make_turned_bench

ENTRIES = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


WIDER, PUSHED_M_S = 3.0, 0.2  # 20 degrees, and 7 cm by x and as much by y


def entries_of(seed: int, duration_s: float, wires: int, six: bool) -> tuple[list[float], ...]:
    """The six entries' errors and deviations, per cent of the largest moment, and their ratios."""
    ways = WAYS[3] if six else LAID
    wide = wires == 3 and not six
    moved = (WIDER, PUSHED_M_S) if wide else (1.0, UNWANTED_M_S)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truth = make_turned_bench(folder, seed, duration_s, 2, wires, ways, *moved)
        if freeswing(["identify", str(folder), "--quiet"]) != 0:
            raise SystemExit(f"seed {seed}: identify failed")
        told = json.loads((folder / "results" / "identification.json").read_text("utf-8"))
    rows = {row["name"]: row for row in told["objects"][1]["parameters"]}
    largest = float(np.max(np.linalg.eigvalsh(truth.tensor_kg_m2)))
    off = {
        entry: rows[f"I{entry}_kg_m2"]["value"] - truth.tensor_kg_m2[place]
        for entry, place in ENTRIES.items()
    }
    std = [rows[f"I{entry}_kg_m2"]["std"] for entry in off]
    percent = [100.0 * one / largest for one in off.values()]
    claimed = [100.0 * one / largest for one in std]
    return percent, claimed, [one / own for one, own in zip(off.values(), std, strict=True)]


def main() -> None:
    """Run all seeds."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--wires", type=int, choices=(2, 3), default=2)
    parser.add_argument("--six-ways", action="store_true", help="lay the object six ways")
    parser.add_argument("--duration-s", type=float, default=10.0)
    options = parser.parse_args()
    began, every, deviations = time.process_time(), [], []
    print("seed  " + "  ".join(f"I{entry:6}" for entry in ENTRIES) + "  (% of the largest moment)")
    for seed in range(options.first, options.first + options.seeds):
        asked = seed, options.duration_s, options.wires, options.six_ways
        percent, claimed, z = entries_of(*asked)
        every.append(percent)
        deviations.append(z)
        print(f"{seed:4}  " + "  ".join(f"{one:+7.3f}" for one in percent))
        print("   +- " + "  ".join(f"{one:7.3f}" for one in claimed), flush=True)
    found = {
        "worst_percent": float(np.abs(every).max()),
        "worst_deviations": float(np.abs(deviations).max()),
        "within_95_percent": float(np.mean(np.abs(deviations) < 1.96)),
        "processor_s": time.process_time() - began,
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
