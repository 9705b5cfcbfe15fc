"""Figures of a benchmark as a table and as JSON: one row a figure, with its limit where it has one.

    rows = [Row("swing", best_of(lambda: simulate(...)), "s", 0.05)]
    publish("model_speed", rows)

prints the table, then one line of JSON; with `--json PATH` among the arguments it is written too.
"""

from __future__ import annotations

import json
import os
import platform
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Row:
    """One figure.

    Attributes:
        name: what was measured.
        value: the figure.
        unit: its unit.
        limit: the most it may be, or None.
        note: anything a reader should know.
    """

    name: str
    value: float
    unit: str
    limit: float | None = None
    note: str = ""

    @property
    def kept(self) -> bool:
        """Whether the figure is within its limit."""
        return self.limit is None or self.value <= self.limit


def best_of(work: Callable[[], object], repeats: int = 5) -> float:
    """Shortest processor time of `work` in seconds, all its threads together.

    On an idle machine that is the wall-clock time of single-threaded work; other programs do not
    disturb it as much.
    """
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def publish(title: str, rows: Sequence[Row]) -> int:
    """Print table and JSON, write the JSON where `--json PATH` asks for it; 1 if a limit broke."""
    width = max(len(row.name) for row in rows)
    print(f"{title}\n{'-' * len(title)}")
    for row in rows:
        limit = "" if row.limit is None else f"<= {row.limit:g}"
        verdict = "" if row.limit is None else ("ok" if row.kept else "MISSED")
        figure = f"{row.value:12.5g} {row.unit:8s} {limit:12s} {verdict:7s}"
        print(f"{row.name:{width}s} {figure} {row.note}".rstrip())
    machine = {"cores": os.cpu_count(), "python": platform.python_version()}
    machine["load"] = round(os.getloadavg()[0], 1) if hasattr(os, "getloadavg") else None
    document = {"benchmark": title, "machine": machine, "rows": [asdict(row) for row in rows]}
    print(json.dumps(document))
    if "--json" in sys.argv:
        Path(sys.argv[sys.argv.index("--json") + 1]).write_text(json.dumps(document, indent=1))
    return 0 if all(row.kept for row in rows) else 1
