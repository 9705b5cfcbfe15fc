"""How long the demonstration takes, step by step: wall clock and processor, children included.

Each run is a process of its own. `--cold` gives it an empty folder for compiled functions, as on
the first run in a new environment; the figures are then those of a first run.

    python benchmarks/cameras/demo_time.py [--cold] [--mocap] [--json PATH]
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.harness import Row, publish

ROOT = Path(__file__).resolve().parents[2]
WALL_LIMIT_S = 45.0  # on two cores with nothing else to do


def lines_of(command: list[str], environment: dict[str, str]) -> list[tuple[float, str]]:
    """What a command says, each line with the seconds after its start.

    Raises:
        CalledProcessError: where it fails.
    """
    start = time.perf_counter()
    with subprocess.Popen(
        command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True
    ) as process:
        said = [(time.perf_counter() - start, line.rstrip()) for line in process.stdout or ()]
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    return [*said, (time.perf_counter() - start, "end")]


def step_rows(said: list[tuple[float, str]]) -> list[Row]:
    """The wall clock of each step, from the line that opens it to the next one's."""
    opens = {"recording": "recording", "calibrate:": "calibrate", "track:": "track"}
    opens |= {"identify:": "identify", "diagnose:": "diagnose and report", "end": "end"}
    steps = [(at, opens[first]) for at, line in said if (first := line.partition(" ")[0]) in opens]
    rows = [Row("start", steps[0][0], "s")]
    for (at, name), (until, _) in pairwise(steps):
        rows.append(Row(name, until - at, "s"))
    return rows


def main() -> int:
    """Run it once and tell."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cold", action="store_true")
    parser.add_argument("--mocap", action="store_true")
    parser.add_argument("--json", metavar="PATH")
    options = parser.parse_args()
    more = ["--mocap"] if options.mocap else []
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
        if options.cold:
            environment["NUMBA_CACHE_DIR"] = str(Path(folder) / "compiled")
        command = [sys.executable, "-m", "freeswing", "demo", str(Path(folder) / "demo"), *more]
        said = lines_of(command, environment)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    limit = None if options.cold else WALL_LIMIT_S
    rows = [
        *step_rows(said),
        Row("all, wall clock", said[-1][0], "s", limit, "of a machine that may be busy"),
        Row("all, processor", used.ru_utime + used.ru_stime, "s"),
    ]
    return publish("demo_time", rows)


if __name__ == "__main__":
    sys.exit(main())
