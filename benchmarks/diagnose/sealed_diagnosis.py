"""The diagnosis on sealed sessions: what it names, what it misses, what it claims on clean data.

    python benchmarks/diagnose/sealed_diagnosis.py OUT --tier quick --only drag

makes the sessions of sealed_sessions.py in OUT (those that are not there), runs
`freeswing diagnose` on each as a user would, and prints the confusion matrix, the false alarms,
the smallest size found of each effect, and prediction errors before and after beside the noise.
A session that has a result is not run again, and kinds take turns, so that a run may be stopped.
With --visibility what is missed is told apart by how far it stands out of the noise at all.
Figures go to OUT/sealed_diagnosis.json too; reliability.py draws the probabilities.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

from benchmarks.diagnose.reliability import Told, binned  # noqa: E402
from benchmarks.diagnose.sealed_sessions import made, selected  # noqa: E402
from tests.oracle.recorded.cases import TIERS, Case  # noqa: E402
from tests.oracle.scenes.effects import SIZES  # noqa: E402

FLOOR_FACTOR = 1.5
SEEN = 4.0  # deviations of all data together, below which no diagnosis can be asked for an effect
TIMEOUT_S = 1800


def diagnosed(case: Case, root: Path, with_visibility: bool = False) -> dict[str, Any]:
    """One case's row: its result, made unless it is there; how visible what was missed is."""
    made(case, root, with_visibility=False)
    folder = root / case.name
    result, timing = folder / "results" / "diagnosis.json", folder / "truth" / "diagnosis_s.json"
    if not result.exists() or not timing.exists():
        start = time.perf_counter()
        command = [sys.executable, "-m", "freeswing", "diagnose", str(folder)]
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False
        )
        if done.returncode:
            return {"case": case.name, "kind": case.kind, "failed": done.stderr.strip()[-300:]}
        timing.write_text(json.dumps(time.perf_counter() - start))
    document = json.loads(result.read_text())
    row = judged(case, document, json.loads(timing.read_text()), folder)
    if with_visibility and case.kind in ("single", "pair") and not right(row):
        row["visibility"] = made(case, root, with_visibility=True)["visibility"]
    return row


def judged(case: Case, document: dict[str, Any], seconds: float, folder: Path) -> dict[str, Any]:
    """How a result compares with what was put in."""
    named = [{entry["effect"], *entry.get("confounded_with", [])} for entry in document["accepted"]]
    truth = [name for name, _ in case.effects]
    found = [name for name in truth if any(name in group for group in named)]
    wrong = [sorted(group) for group in named if not group & set(truth)]
    after, before = document["after"], document["before"]
    floor = after["noise_floor_m"]
    return {
        "case": case.name,
        "kind": case.kind,
        "effects": list(case.effects),
        "accepted": [sorted(group) for group in named],
        "found": found,
        "wrong": wrong,
        "unexplained": document["unexplained"]["present"],
        "before_over_floor": before["prediction_rmse_m"] / floor,
        "after_over_floor": after["prediction_rmse_m"] / floor,
        "probabilities": [
            [one["effect"], one["probability"], one["effect"] in truth]
            for one in document["candidates"]
            if one.get("probability") is not None
        ],
        **(of_lab_day(document, folder) if case.kind.endswith("lab") else {}),
        "seconds": seconds,
    }


def of_lab_day(document: dict[str, Any], folder: Path) -> dict[str, Any]:
    """How far inertia and a moved attachment are from the truth, in claimed deviations and mm."""
    truth = json.loads((folder / "truth" / "truth.json").read_text())
    true = [*truth["com_m"], *truth["specific_inertia_m2"]]
    pairs = zip(document["parameters_after"], true, strict=True)
    row: dict[str, Any] = {"inertia_z": [(p["value"] - v) / p["std"] for p, v in pairs]}
    moved = next((e for e in truth["effects"] if e["effect"] == "attachment_offset"), None)
    told = {
        p["name"]: (p["value"], p["std"])
        for entry in document["accepted"]
        for p in entry["parameters"]
        if entry["effect"] == "attachment_offset"
    }
    if moved is not None and told:
        wanted = (f"offset_{moved['cable'] + 1}_{axis}_m" for axis in "xyz")
        found = [told.get(name, (0.0, 0.0)) for name in wanted]
        off = [1e3 * (v - w) for (v, _), w in zip(found, moved["true_minus_told_m"], strict=True)]
        row |= {"attachment_off_mm": off, "attachment_std_mm": [1e3 * s for _, s in found]}
    return row


def reliability(rows: list[dict[str, Any]]) -> list[str]:
    """Of effects given so much probability, how many are there, as lines."""
    told = [Told(row["case"], *one) for row in rows for one in row.get("probabilities", ())]
    lines = ["", "probability told: how many, mean told, share that is there"]
    for one in binned(told):
        span = f"{one.low:4.2f} to {one.high:4.2f}"
        lines.append(f"  {span}: {one.count:4d} {one.told:6.3f} {one.there:6.3f}")
    return lines


def telling_first(cases: Sequence[Case]) -> list[Case]:
    """Kinds taking turns and medium sizes first, so that a run that is stopped says something."""
    medium = sorted(cases, key=lambda case: any(size != "medium" for _, size in case.effects))
    kinds = dict.fromkeys(case.kind for case in cases)
    queues = [[case for case in medium if case.kind == kind] for kind in kinds]
    turns = zip_longest(*queues)
    return [case for turn in turns for case in turn if case is not None]


def right(row: dict[str, Any]) -> bool:
    """Whether a case was answered as it should be."""
    if "failed" in row:
        return False
    if row["kind"] == "outside":
        return row["unexplained"] or not row["accepted"]
    return len(row["found"]) == len(row["effects"]) and not row["wrong"]


def line(row: dict[str, Any]) -> str:
    """One line of the table."""
    if "failed" in row:
        return f"{row['case']:66s} FAILED {row['failed']}"
    answer = "; ".join("/".join(group) for group in row["accepted"]) or "none"
    rest = " + unexplained" if row["unexplained"] else ""
    return (
        f"{row['case']:66s} {'ok ' if right(row) else 'NO '} "
        f"{row['before_over_floor']:8.2f} {row['after_over_floor']:8.2f} "
        f"{row['seconds']:6.0f} {answer}{rest}"
    )


def summary(rows: list[dict[str, Any]]) -> list[str]:
    """Confusion matrix, false alarms, smallest sizes and floors, as lines."""
    lines = ["", "put in -> named (single effects; how often):"]
    pairs = Counter(
        (row["effects"][0][0], "/".join(n for group in row["accepted"] for n in group) or "none")
        for row in rows
        if row["kind"] == "single" and "failed" not in row
    )
    lines += [
        f"  {put:24s} -> {named:60s} {count}" for (put, named), count in sorted(pairs.items())
    ]
    clean = [row for row in rows if row["kind"] in ("clean", "quiet lab") and "failed" not in row]
    alarms = sum(bool(row["accepted"]) for row in clean)
    lines.append(f"false alarms on clean sessions: {alarms} of {len(clean)}")
    sizes: dict[str, list[str]] = {}
    for row in rows:
        if row["kind"] == "single" and "failed" not in row and row["found"]:
            name, size = row["effects"][0]
            sizes.setdefault(name, []).append(size)
    smallest = {name: min(found, key=SIZES.index) for name, found in sizes.items()}
    lines.append("smallest size found: " + ", ".join(f"{k} {v}" for k, v in smallest.items()))
    held = [row for row in rows if row.get("effects") and row["kind"] in ("single", "pair")]
    near = sum(row["after_over_floor"] <= FLOOR_FACTOR for row in held if "failed" not in row)
    lines.append(f"prediction within {FLOOR_FACTOR} times the noise after: {near} of {len(held)}")
    for kind in ("clean", "single", "pair", "outside", "lab", "quiet lab"):
        of_kind = [row for row in rows if row["kind"] == kind]
        if of_kind:
            lines.append(f"right answers, {kind}: {sum(map(right, of_kind))} of {len(of_kind)}")
    known = {row["case"]: row["visibility"] for row in rows if "visibility" in row}
    unseen = sum(size < SEEN for size in known.values())
    lines.append(f"of those missed below {SEEN:g} deviations: {unseen} of {len(known)} known")
    lines += [f"  {name}: {size:.1f} deviations" for name, size in known.items()]
    return lines + reliability(rows)


def main(arguments: list[str] | None = None) -> None:
    """Make, diagnose and judge the sessions."""
    parser = argparse.ArgumentParser(description="The diagnosis on sealed sessions.")
    parser.add_argument("out", type=Path)
    parser.add_argument("--tier", choices=TIERS, default="quick")
    parser.add_argument("--only", help="cases whose name holds this")
    parser.add_argument("--draw", type=int, default=0, help="another number: other seeds")
    parser.add_argument(
        "--visibility", action="store_true", help="how far what is missed stands out: a minute each"
    )
    options = parser.parse_args(arguments)
    rows = []
    print(f"{'case':66s} ok?   before    after      s answer (errors over the noise floor)")
    for case in telling_first(selected(options.tier, options.only, options.draw)):
        rows.append(diagnosed(case, options.out, options.visibility))
        print(line(rows[-1]), flush=True)
    print("\n".join(summary(rows)))
    (options.out / "sealed_diagnosis.json").write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
