"""How long a diagnosis takes, beside what it may take on two quiet cores.

    python benchmarks/diagnose/diagnose_speed.py SCRATCH --only sample ten

(there are sample, ten, screen, stretch, bologna and demo) runs the commands as a user does, each in
a process of its own: seconds of the clock, and of all processors together, workers included. Sealed
sessions are made in SCRATCH unless they are there; `bologna` needs ../shared/real/bologna-2020.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

from benchmarks.harness import Row, publish  # noqa: E402

CASES = {
    "ten": ("clean-00-bologna-4-pose", 15.0),
    "stretch": ("single-cable_elasticity.medium-three-cable-free", 60.0),
    "pair": ("pair-translational_drag.medium+attachment_offset.medium-bologna-4-pose", 15.0),
}
FIRST_SCREEN_S = 3.0


def timed(arguments: list[str]) -> tuple[float, float, str]:
    """Seconds of the clock and of processors that a command takes, and what it said."""
    before, start = os.times(), time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "freeswing", *arguments],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    wall, after = time.perf_counter() - start, os.times()
    if done.returncode:
        raise RuntimeError(f"freeswing {' '.join(arguments)}: {done.stderr[-500:]}")
    worked = after.children_user + after.children_system
    return wall, worked - before.children_user - before.children_system, done.stdout


def rows_of(name: str, folder: Path, scratch: Path, limit: float) -> list[Row]:
    """Clock and processors of one session's diagnosis, and what it accepted."""
    wall, worked, said = timed(
        ["diagnose", str(folder), "--results", str(scratch / f"results-{name}")]
    )
    named = [line.split()[1:] for line in said.splitlines() if "accepted:" in line]
    note = "; ".join(" ".join(words) for words in named)[:60] or "nothing accepted"
    return [
        Row(f"diagnose, {name}", wall, "s", limit, note),
        Row(f"diagnose, {name}: processors", worked, "s"),
    ]


def sealed(key: str, scratch: Path) -> Path:
    """A sealed session, made unless it is there."""
    from benchmarks.diagnose.sealed_sessions import made, selected

    (case,) = selected("quick", CASES[key][0])
    made(case, scratch, with_visibility=False)
    return scratch / case.name


def first_screen(folder: Path) -> Row:
    """Seconds of one processor that screening all candidates takes, first call of a process.

    One thread for linear algebra, as every command has it: idle ones spin and are counted.
    """
    code = f"""
import time
from freeswing.ident.diagnose import search
from freeswing.session.load_swings import load_robot, load_swings, load_target
from freeswing.session.session_file import read_session
from freeswing.ident.diagnose.diagnose import diagnose
session = read_session({str(folder / "session.toml")!r})
robot = load_robot(session)
runs = list(load_swings(session, robot, load_target(session)))
original = search.Search._screens
class Done(Exception): pass
def told(*arguments):
    start = time.process_time()
    original(*arguments)
    raise Done(time.process_time() - start)
search.Search._screens = told
try:
    diagnose(runs, robot)
except Done as seconds:
    print(seconds)
"""
    one = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    said = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env={**os.environ, **one},
        capture_output=True,
        text=True,
        check=True,
    )
    return Row("first screen of all candidates", float(said.stdout), "s", FIRST_SCREEN_S)


def main() -> int:
    """Take the times that are asked for."""
    parser = argparse.ArgumentParser(description="Times of a diagnosis, beside their limits.")
    parser.add_argument("scratch", type=Path)
    names = ("sample", "screen", "bologna", "demo", *CASES)
    parser.add_argument("--only", nargs="+", choices=names, default=names)
    parser.add_argument("--json", type=Path, help="write the figures there too")
    options = parser.parse_args()
    options.scratch.mkdir(parents=True, exist_ok=True)
    scratch, rows = options.scratch.resolve(), []
    sample = ROOT / "samples" / "undeclared-drag"
    for name in options.only:
        if name == "screen":
            rows.append(first_screen(sample))
        elif name == "demo":
            wall, worked, _ = timed(["demo", str(scratch / f"demo-{int(time.time())}")])
            rows += [Row("demo", wall, "s", 45.0), Row("demo: processors", worked, "s")]
        elif name == "sample":
            rows += rows_of(name, sample, scratch, 15.0)
        elif name == "bologna":
            rows += rows_of(name, ROOT.parent / "shared/real/bologna-2020", scratch, 120.0)
        else:
            rows += rows_of(name, sealed(name, scratch), scratch, CASES[name][1])
    return publish("diagnose_speed", rows)


if __name__ == "__main__":
    sys.exit(main())
