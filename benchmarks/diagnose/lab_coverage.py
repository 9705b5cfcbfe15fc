"""How often 95 % intervals of a diagnosis hold the truth, over days in a laboratory.

    python benchmarks/diagnose/lab_coverage.py OUT --days 50 --effect rotational_drag=medium

makes days of marker recordings (tests/oracle/recorded/lab_days.py: a marker biased in half the
runs, its layout off), diagnoses each, and counts how many of the intervals value +- 1.96 deviations
hold the inertia that was put in. Days may lack nothing, or the effects named, which are then the
only candidates: that they are found is the business of sealed_diagnosis.py beside this. A day that
has a result in OUT is not run again; figures go to OUT/coverage.json.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

from benchmarks.harness import Row, publish  # noqa: E402
from freeswing.ident.diagnose.diagnose import diagnose  # noqa: E402
from freeswing.session.load_swings import load_robot, load_swings, load_target  # noqa: E402
from freeswing.session.session_file import read_session  # noqa: E402
from tests.oracle.recorded.lab_days import make_lab_day  # noqa: E402

NORMAL_95 = 1.96
FIRST_SEED = 5000


def deviations(folder: Path, seed: int, options: argparse.Namespace) -> dict[str, Any]:
    """One day's errors of the inertia in claimed deviations, with its processor time."""
    effects = dict(one.split("=") for one in options.effect)
    sizes = {name: size if size.isalpha() else float(size) for name, size in effects.items()}
    make_lab_day(
        folder, seed, options.robot, sizes, n_runs=options.runs, duration_s=options.seconds
    )
    session = read_session(folder / "session.toml")
    robot = load_robot(session)
    runs = list(load_swings(session, robot, load_target(session)))
    start = time.process_time()
    told = diagnose(runs, robot, None, 1, tuple(effects)).document()
    truth = json.loads((folder / "truth" / "truth.json").read_text())
    true = [*truth["com_m"], *truth["specific_inertia_m2"]]
    pairs = list(zip(told["parameters_after"], true, strict=True))
    return {
        "seed": seed,
        "z": [(one["value"] - value) / one["std"] for one, value in pairs],
        "std": [one["std"] for one, _ in pairs],
        "named": [one["effect"] for one in told["accepted"]],
        "seconds": time.process_time() - start,
    }


def main(arguments: list[str] | None = None) -> int:
    """Make, diagnose and count; exit status 1 where too few or too many intervals hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--days", type=int, default=50)
    parser.add_argument("--robot", default="bologna-4")
    parser.add_argument("--runs", type=int, default=8)
    parser.add_argument("--seconds", type=float, default=6.0, help="of each run")
    parser.add_argument("--effect", action="append", default=[], metavar="NAME=SIZE")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args(arguments)
    kept = options.out / "coverage.json"
    rows: list[dict[str, Any]] = json.loads(kept.read_text()) if kept.exists() else []
    for seed in range(FIRST_SEED, FIRST_SEED + options.days):
        if seed not in [row["seed"] for row in rows]:
            rows.append(deviations(options.out / f"day-{seed}", seed, options))
            kept.write_text(json.dumps(rows, indent=1) + "\n")
            print(seed, np.round(rows[-1]["z"], 1), rows[-1]["named"], flush=True)
    z = np.abs([row["z"] for row in rows])
    complete = [
        row for row in rows if set(row["named"]) == {e.split("=")[0] for e in options.effect}
    ]
    return publish(
        "lab_coverage",
        [
            Row(
                "days", len(rows), "", note=f"{len(complete)} with all effects named, none besides"
            ),
            Row("95 % intervals that hold", 100.0 * float(np.mean(z < NORMAL_95)), "%"),
            Row("largest deviation", float(z.max()), "claimed"),
            Row("rms deviation", float(np.sqrt(np.mean(z**2))), "claimed"),
        ],
    )


if __name__ == "__main__":
    sys.exit(main())
