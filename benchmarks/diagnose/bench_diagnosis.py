"""What `diagnose` finds on benches that lack one thing each: found or not, its value and deviation.

    python -m benchmarks.diagnose.bench_diagnosis OUT --seen poses --seen plane --seen chi

makes sessions by another simulator (tests/oracle/recorded/benches.py: two empty runs, one with a
known mass, two with the object, 6 s each), diagnoses each by the command, and prints what it says
of the one thing that the files do not say. `--weights 3` has three runs with the known mass, on
both sides and in the middle. A case whose result stands in OUT is not run again.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.harness import Row, publish
from freeswing.main import main as freeswing
from tests.oracle.recorded.benches import (
    BOTH_SIDES_M,
    DECLARED_KG,
    PLATFORM_COM_M,
    WEIGHT_M,
    Hidden,
    make_bench,
)

SEED = 3
EMPTY, LOADED = 2, 2  # runs
SPAN_S = 6.0


@dataclass(frozen=True, slots=True)
class Case:
    """One session: what the files do not say, and the number that should come back.

    Attributes:
        hidden: what is true and not told.
        effect: that should be named, or found in a group; "": none.
        parameter: of it.
        true: its value.
    """

    hidden: Hidden
    effect: str = ""
    parameter: str = ""
    true: float = 0.0


ECCENTRIC_M = (0.003, -0.004, 0.0)
HOLD_N_M = 0.02
YIELDS_N_M, ONE_YIELDS_N_M = 2000.0, 500.0  # sideways: wires seem longer by tension over it
CASES = {
    "nothing": Case(Hidden(0.0, 1.0, 0.0, 0.0)),
    "drag": Case(Hidden(0.0, 1.0, 2e-3, 0.02), "rotational_drag", "rate_m2_s", 2e-3 / DECLARED_KG),
    "wire": Case(Hidden(2e-3, 1.0, 0.0, 0.0), "cable_length_bias", "bias_1_m", 2e-3),
    "tilt": Case(Hidden(0.0, 1.0, 0.0, 0.0, (0.01, -0.006)), "gravity_tilt", "tilt_x_rad", 0.01),
    "stretch": Case(
        Hidden(0.0, 1.0, 0.0, 0.0, stiffness_ea_n=2500.0),
        "cable_elasticity",
        "mass_over_stiffness_s2_m",
        DECLARED_KG / 2500.0,
    ),
    "mass": Case(Hidden(0.0, 1.05, 0.0, 0.0), "platform_mass", "mass_kg", 1.05 * DECLARED_KG),
    "eccentric clamp": Case(
        Hidden(0.0, 1.0, 0.0, 0.0, eccentric_m=ECCENTRIC_M),
        "attachment_offset",
        "offset_1_x_m",
        ECCENTRIC_M[0],
    ),
    "holding clamp": Case(
        Hidden(0.0, 1.0, 0.0, 0.0, hold_n_m=HOLD_N_M),
        "torsion_spring",
        "stiffness_m2_s2",
        HOLD_N_M / DECLARED_KG,
    ),
    "yielding hooks": Case(
        Hidden(0.0, 1.0, 0.0, 0.0, yields_n_m=YIELDS_N_M),
        "yielding_clamp",
        "mass_over_stiffness_s2",
        DECLARED_KG / YIELDS_N_M,
    ),
    "one yielding hook": Case(
        Hidden(0.0, 1.0, 0.0, 0.0, yields_n_m=ONE_YIELDS_N_M, yielding=1),
        "yielding_clamp",
        "mass_over_stiffness_1_s2",
        DECLARED_KG / ONE_YIELDS_N_M,
    ),
}


def one_case(folder: Path, case: Case, seen: str, wires: int, weights: int) -> dict[str, Any]:
    """What `diagnose` says of one session, and how far bodies are off after it."""
    places = (WEIGHT_M,) if weights == 1 else BOTH_SIDES_M
    counts = (EMPTY, weights, LOADED)
    truth = make_bench(folder, SEED, wires, seen, SPAN_S, counts, case.hidden, places)
    start = time.process_time()
    status = freeswing(["diagnose", str(folder), "--workers", "1", "--quiet"])
    seconds = time.process_time() - start
    if status != 0:
        return {"status": status, "seconds": seconds}
    told = json.loads((folder / "results" / "diagnosis.json").read_text(encoding="utf-8"))
    rows = {row["effect"]: row for row in told["candidates"]}
    numbers = {
        f"{one['effect']}.{row['name']}": (row["value"], row["std"])
        for one in told["accepted"]
        for row in one["parameters"]
    }
    bodies = {}
    for one in told.get("objects_after", ()):
        true = truth.platform_izz_p if one["name"] == "platform" else truth.load_izz
        name = "Izz_P_kg_m2" if one["name"] == "platform" else "Izz_kg_m2"
        bodies[one["name"]] = _off({r["name"]: r for r in one["parameters"]}[name], true)
        if one["name"] == "platform":
            centre = {r["name"]: r for r in one["parameters"]}["com_x_m"]
            bodies["com_x"] = _off(centre, float(PLATFORM_COM_M[0]))
    return {
        "status": status,
        "seconds": seconds,
        "verdict": rows.get(case.effect, {}).get("verdict", "") if case.effect else "",
        "rivals": rows.get(case.effect, {}).get("confounded_with", []),
        "reason": rows.get(case.effect, {}).get("reason", ""),
        "accepted": [
            (one["effect"], one.get("part", ""), one["confounded_with"]) for one in told["accepted"]
        ],
        "numbers": numbers,
        "bodies": bodies,
        "unexplained": told["unexplained"]["signature"],
    }


def _off(row: dict[str, Any], true: float) -> dict[str, float | None]:
    if row["value"] is None or not row["std"]:
        return {"off": None, "z": None}
    return {"off": row["value"] / true - 1.0, "z": (row["value"] - true) / row["std"]}


def verdict_of(case: Case, told: dict[str, Any]) -> str:
    """Named, in a group, cannot tell, missed, false alarm or nothing, as it should be."""
    others = [effect for effect, _, rivals in told["accepted"] if case.effect not in rivals]
    if not case.effect:
        return "false alarm" if others else "nothing"
    mine = [effect for effect in others if effect == case.effect]
    grouped = [effect for effect, _, rivals in told["accepted"] if case.effect in rivals]
    more = f", and {', '.join(e for e in others if e != case.effect)}" if others != mine else ""
    if mine:
        return ("in a group" if told["rivals"] else "named") + more
    if grouped:
        return f"in the group of {grouped[0]}{more}"
    if told["unexplained"]:
        return f"unexplained{more}"
    return ("cannot tell" if told["verdict"] == "not_identifiable" else "missed") + more


def main(arguments: list[str] | None = None) -> int:
    """Make, diagnose and tabulate."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--seen", action="append", choices=("poses", "plane", "chi", "track"))
    parser.add_argument("--wires", type=int, choices=(2, 3), default=3)
    parser.add_argument("--weights", type=int, default=1, help="runs with the known mass")
    parser.add_argument("--case", action="append", choices=tuple(CASES))
    parser.add_argument("--json", type=Path)
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / "diagnoses.json"
    kept: dict[str, Any] = json.loads(path.read_text()) if path.exists() else {}
    rows = []
    for seen in options.seen or ("poses",):
        for name in options.case or CASES:
            case, key = CASES[name], f"{options.wires} wires, {seen}, {name}"
            key += "" if options.weights == 1 else f", {options.weights} weights"
            if key not in kept:
                folder = options.out / key.replace(", ", "-").replace(" ", "-")
                kept[key] = one_case(folder, case, seen, options.wires, options.weights)
                path.write_text(json.dumps(kept, indent=1) + "\n")
            rows += _rows(key, case, kept[key])
            print(key, json.dumps(kept[key]), flush=True)
    return publish("bench_diagnosis", rows)


def _rows(key: str, case: Case, told: dict[str, Any]) -> list[Row]:
    if told["status"] != 0:
        return [Row(key, float(told["status"]), "exit status")]
    value, std = told["numbers"].get(f"{case.effect}.{case.parameter}", (float("nan"), None))
    z = "" if not std else f", {(value - case.true) / std:+.1f} of its deviations off"
    note = f"{verdict_of(case, told)}; true {case.true:g}{z}"
    body = told["bodies"].get("object", {}).get("off")
    found = [Row(key, value, "", note=note)]
    if body is not None:
        z = told["bodies"]["object"]["z"]
        found.append(Row(f"{key}: object's Izz", 100.0 * body, "%", note=f"{z:+.1f} deviations"))
    return [*found, Row(f"{key}: time", told["seconds"], "s")]


if __name__ == "__main__":
    sys.exit(main())
