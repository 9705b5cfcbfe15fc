"""The plan of a bench as a document and as a table of words."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.robot import Robot
from freeswing.excite.bench_plan import BenchCase, PlanRow, deviations

HOOP = 0.5  # of mass x radius^2: the platform's inertia where none is given, a full disc's
SMALL = 0.1  # the same of an object that lies on it
LEAST = 0.02  # of the largest source: below it is not worth a word
WORDS = {
    "twist_deg": "first twist (degrees)",
    "duration_s": "length of a run (s)",
    "known_at": "known mass, from the middle (of the wires' radius)",
    "length_m": "wires (m)",
    "radius": "radius of the wires' ends (times today's)",
}


def bench_case(robot: Robot, load_kg: float | None, load_izz: float | None) -> BenchCase:
    """The case of a robot file whose wires hang parallel.

    Args:
        robot: two or three parallel wires.
        load_kg: of the object; None: as heavy as the platform.
        load_izz: a guess of its inertia, kg m2; None: a small object's.

    Raises:
        DataError: when the platform's mass is not given.
    """
    mass = robot.platform.mass_kg
    if mass is None:
        raise DataError("mass_kg of the platform is not given: weigh it with all that hangs on it")
    ends = robot.attachments_m - robot.attachments_m.mean(axis=0)
    radius = float(np.sqrt(np.mean(np.sum(ends**2, axis=1))))
    length = float(np.mean(np.linalg.norm(robot.entries_m - robot.attachments_m, axis=1)))
    given = robot.platform.specific_inertia_m2
    izz = mass * (HOOP * radius**2 if given is None else float(given[2]))
    load = load_kg or mass
    return BenchCase(
        mass_kg=mass,
        izz_kg_m2=izz,
        load_kg=load,
        load_izz_kg_m2=load_izz or SMALL * load * radius**2,
        radius_m=radius,
        length_m=length,
        known_kg=0.5 * load,
    )


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
    return [*lines, f"what remains of {document['percent']:.2f} %: {', '.join(told)}"]
