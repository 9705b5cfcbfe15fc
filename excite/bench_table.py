"""The plan of a bench as a document and as a table of words."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from freeswing.excite.bench_plan import BenchCase, PlanRow, deviations

LEAST = 0.02  # of the largest source: below it is not worth a word
WORDS = {
    "twist_deg": "first twist (degrees)",
    "duration_s": "length of a run (s)",
    "known_at": "known mass, from the middle (of the wires' radius)",
    "length_m": "wires (m)",
    "radius": "radius of the wires' ends (times today's)",
}


def bench_document(best: BenchCase, rows: list[PlanRow]) -> dict[str, Any]:
    """The content of results/bench-plan.json."""
    shares = deviations(best)
    scale = 100.0 / best.load_izz_kg_m2
    sources = sorted(shares.items(), key=lambda one: -one[1])
    return {
        "format": "freeswing-bench-plan/1",
        "percent": scale * shares["total"],
        "choices": [asdict(row) for row in rows],
        "sources": [
            {"what": name, "percent": scale * value} for name, value in sources if name != "total"
        ],
        "assumed": {name: float(value) for name, value in asdict(best).items()},
    }


HOLDS = (
    "this holds with three runs of each kind, of poses or of x, y and yaw, half of those with the "
    "known mass on the opposite side: all on one side, a centre of mass beside the middle counts "
    "as much again; by yaw alone where com_m is not given, three to five times as much"
)


def bench_words(document: dict[str, Any]) -> list[str]:
    """The plan's one table, a line a choice, then what remains."""
    lines = [f"{'':50}  value  Izz of the object ± % (one deviation)"]
    for row in document["choices"]:
        mark = "  <- plan" if row["best"] else ""
        lines.append(f"{WORDS[row['what']]:50} {row['value']:6.4g}  {row['percent']:.2f}{mark}")
    most = document["sources"][0]["percent"]
    told = [
        f"{one['what']} {one['percent']:.2f} %"
        for one in document["sources"]
        if one["percent"] >= LEAST * most
    ]
    return [*lines, f"what remains of {document['percent']:.2f} %: {', '.join(told)}", HOLDS]
