"""Sealed sessions for the diagnosis: makes them, says how visible their effects are.

    python benchmarks/diagnose/sealed_sessions.py OUT --tier quick --only drag --visibility

writes one session folder a case into OUT (the truth in its `truth/` subfolder, which no product
code reads) and OUT/sealed_sessions.json, and prints a table. A case that is already there is
kept, so that a stopped run goes on. The motions come from tests/oracle, an independent integrator.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

from tests.oracle.recorded.cases import TIERS, Case, manifest  # noqa: E402
from tests.oracle.recorded.visibility import visibility  # noqa: E402

SEEN_RUNS = 4  # of each session; their visibility is scaled up to all runs
HEADER = f"{'case':70s} {'seconds':>7s} {'taut N':>7s} {'reach mm':>8s} {'visible':>8s}"


def selected(tier: str, only: str | None, draw: int = 0) -> list[Case]:
    """The cases of a tier whose name holds `only`, with the seeds of a draw.

    Raises:
        ValueError: when there is none.
    """
    cases = [case for case in manifest(tier, draw) if only is None or only in case.name]
    if not cases:
        raise ValueError(f"no case of tier {tier!r} has {only!r} in its name")
    return cases


def made(case: Case, root: Path, with_visibility: bool) -> dict[str, Any]:
    """Makes one session unless it is there; its row of the table."""
    row_file = root / case.name / "truth" / "row.json"
    if row_file.exists():
        row = json.loads(row_file.read_text())
        if "visibility" in row or not with_visibility:
            return row
    start = time.perf_counter()
    truth = case.make(root)
    row = {
        **asdict(case),
        "seed": case.seed,
        "seconds": time.perf_counter() - start,
        "least_tension_n": min(float(run.motion.tensions_n.min()) for run in truth.runs),
        "largest_reach_m": max(_reach(run) for run in truth.runs),
    }
    if with_visibility:
        seen = visibility(truth, case.robot, case.pose, n_runs=SEEN_RUNS) if case.effects else 0.0
        row["visibility"] = seen
    row_file.write_text(json.dumps(row, indent=1) + "\n")
    return row


def _reach(run: Any) -> float:
    way = run.release_m - run.rest.position_m
    return float((way @ way) ** 0.5)


def line(row: dict[str, Any]) -> str:
    """One line of the table."""
    seen = f"{row['visibility']:8.1f}" if "visibility" in row else "       -"
    return (
        f"{row['name']:70s} {row['seconds']:7.1f} {row['least_tension_n']:7.1f} "
        f"{1e3 * row['largest_reach_m']:8.1f} {seen}"
    )


def main(arguments: list[str] | None = None) -> None:
    """Make the sessions and print their table."""
    parser = argparse.ArgumentParser(description="Make sealed sessions for the diagnosis.")
    parser.add_argument("out", type=Path)
    parser.add_argument("--tier", choices=TIERS, default="quick")
    parser.add_argument("--only", help="part of the names wanted")
    parser.add_argument("--draw", type=int, default=0, help="another number: other seeds")
    parser.add_argument(
        "--visibility", action="store_true", help="fit the plain model to noise-free data"
    )
    options = parser.parse_args(arguments)
    print(HEADER)
    rows = []
    for case in selected(options.tier, options.only, options.draw):
        rows.append(made(case, options.out, options.visibility))
        print(line(rows[-1]), flush=True)
    path = options.out / "sealed_sessions.json"
    path.write_text(json.dumps(rows, indent=1) + "\n")
    print(path)


if __name__ == "__main__":
    main()
