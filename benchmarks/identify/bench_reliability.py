"""How far benches of two or three wires are off, and how often their deviations hold.

    python -m benchmarks.identify.bench_reliability OUT --seeds 20

makes sessions by another simulator (tests/oracle/recorded/benches.py: undeclared drag, one wire
2 mm long, a platform 5 % heavier than declared; 3 empty, 3 known-weight and 4 loaded runs),
identifies each, and compares the object's Izz with what was put in. The known mass lies on both
sides and in the middle, as the guide has it; `--one-side` leaves it where it is. On two wires the
object lies so that the platform hangs rolled by 7.6 degrees; `--level` puts it where all hangs
level, and `--told-level` has the session say so (level_std_rad). `--jobs` sessions run at a time,
each in a process. A session that has a result in OUT/benches.json is not run again.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.harness import Row, publish
from freeswing.ident.bench.identify_bench import identify_bench
from freeswing.session.load_bench import load_bench
from freeswing.session.load_swings import load_robot
from freeswing.session.session_file import read_session
from tests.oracle.recorded.benches import BOTH_SIDES_M, LEVEL_M, WEIGHT_M, make_bench

WANTED_PERCENT = {"poses": 0.5, "chi": 1.0, "track": 2.0}
CLAIMED = 3.0  # deviations
FIRST_SEED = 100
LEVEL_STD_RAD = 0.003  # a spirit level for a workshop: a millimetre on a foot
WIRES = (3, 2)


class Case(NamedTuple):
    """One session."""

    wires: int
    seen: str
    one_side: bool
    level: bool
    seed: int
    told_level: bool = False

    @classmethod
    def of(cls, row: dict[str, Any]) -> Case:
        """That of a result."""
        return cls(**{name: row[name] for name in cls._fields if name in row})

    @property
    def name(self) -> str:
        """What it shares with those of other seeds."""
        told = f"{self.wires} wires, {self.seen}" + (", level" if self.level else "")
        told += " by a spirit level" if self.told_level else ""
        return told + (", weights on one side" if self.one_side else "")


def one_bench(folder: Path, case: Case) -> dict[str, Any]:
    """One session's errors in per cent and in claimed deviations, with its processor time."""
    weights = (WEIGHT_M,) if case.one_side else BOTH_SIDES_M
    places = (LEVEL_M,) if case.level else (np.zeros(3),)
    asked = folder, case.seed, case.wires, case.seen
    truth = make_bench(*asked, weights_m=weights, places_m=places)
    if case.told_level:
        path = folder / "session.toml"
        rows = [
            f"{row}\nlevel_std_rad = {LEVEL_STD_RAD}" if row.startswith("loads = ") else row
            for row in path.read_text("utf-8").splitlines()
        ]
        path.write_text("\n".join(rows) + "\n", "utf-8")
    session = read_session(folder)
    robot = load_robot(session)
    start = time.process_time()
    told = identify_bench(load_bench(session, robot, None), robot).document()
    seconds = time.process_time() - start
    bodies = {o["name"]: {p["name"]: p for p in o["parameters"]} for o in told["objects"]}
    row: dict[str, Any] = case._asdict()
    for name, found, true in (
        ("object", bodies["object"]["Izz_kg_m2"], truth.load_izz),
        ("platform", bodies["platform"]["Izz_P_kg_m2"], truth.platform_izz_p),
        ("mass", bodies["platform"]["mass_kg"], truth.platform_kg),
    ):
        row[name] = _error(found["value"], found["std"], true)
    warned = [note for note in told["notes"] if "RELY" in note or "rely" in note]
    return {**row, "warned": warned, "seconds": seconds}


def _error(value: float | None, std: float | None, true: float) -> dict[str, float | None]:
    """In per cent and in deviations; None where the bench says that it cannot tell."""
    if value is None or std is None:
        return {"percent": None, "std_percent": None, "z": None}
    return {
        "percent": 100.0 * (value / true - 1.0),
        "std_percent": 100.0 * std / true,
        "z": (value - true) / std if std > 0.0 else None,  # a mass that was trusted
    }


def rows_of(kept: list[dict[str, Any]]) -> list[Row]:
    """The figures by bench and by what was measured."""
    found = []
    for name in dict.fromkeys(Case.of(one).name for one in kept):
        mine = [one for one in kept if Case.of(one).name == name]
        seen = [one["object"] for one in mine if one["object"]["z"] is not None]
        off = np.array([abs(one["percent"]) for one in seen])
        z = np.array([abs(one["z"]) for one in seen])
        limit = WANTED_PERCENT[mine[0]["seen"]]
        good = int(np.sum((off < limit) & (z < CLAIMED)))
        claimed = np.median([one["std_percent"] for one in seen]) if seen else np.nan
        note = f"of {len(mine)} within {limit:g} % and {CLAIMED:g} deviations"
        found += [
            Row(name, good, "seeds", note=note),
            Row(f"{name}: largest error", float(off.max(initial=0.0)), "%"),
            Row(f"{name}: rms error", float(np.sqrt(np.mean(off**2))) if seen else np.nan, "%"),
            Row(f"{name}: claimed", float(claimed), "%", note="median deviation"),
            Row(f"{name}: rms", float(np.sqrt(np.mean(z**2))) if seen else np.nan, "deviations"),
            Row(f"{name}: time", float(np.median([one["seconds"] for one in mine])), "s"),
        ]
    return found


def _results(out: Path, cases: Sequence[Case], jobs: int) -> Iterator[dict[str, Any]]:
    """Each session's result, as they come."""
    folders = [out / "-".join(map(str, case)) for case in cases]
    if jobs == 1:
        yield from map(one_bench, folders, cases)
        return
    with ProcessPoolExecutor(jobs) as pool:
        asked = [pool.submit(one_bench, *each) for each in zip(folders, cases, strict=True)]
        for one in as_completed(asked):
            yield one.result()


def main(arguments: list[str] | None = None) -> int:
    """Make, identify and compare; exit status 1 where a limit breaks."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--wires", type=int, choices=WIRES, action="append")
    parser.add_argument("--seen", choices=tuple(WANTED_PERCENT), action="append")
    parser.add_argument("--one-side", action="store_true", help="the known mass never moves")
    parser.add_argument("--level", action="store_true", help="the object laid to hang level")
    parser.add_argument("--told-level", action="store_true", help="and the session says so")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / "benches.json"
    kept: list[dict[str, Any]] = json.loads(path.read_text()) if path.exists() else []
    done = {Case.of(one) for one in kept}
    more = options.one_side, options.level or options.told_level
    asked = [
        Case(wires, seen, *more, seed, options.told_level)
        for seed in range(FIRST_SEED, FIRST_SEED + options.seeds)
        for wires in options.wires or WIRES
        for seen in options.seen or WANTED_PERCENT
    ]
    for row in _results(options.out, [case for case in asked if case not in done], options.jobs):
        kept.append(row)
        path.write_text(json.dumps(kept, indent=1) + "\n")
        told = {k: v and round(v, 3) for k, v in row["object"].items()}
        print(*Case.of(row), told, flush=True)
    return publish("bench_reliability", rows_of(kept))


if __name__ == "__main__":
    sys.exit(main())
