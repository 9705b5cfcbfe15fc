"""Writes the tables and pictures of docs/guide and docs/gallery.md: `make_guide.py [TABLE ..]`.

A table stands in its page between `<!-- table NAME -->` and `<!-- end -->`; tests/docs holds the
pages against what is computed here.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).resolve().parent))

import guide_numbers as numbers

DOCS = Path(__file__).resolve().parents[1]
TOOLS = (  # what an instrument is good to, as its makers say: entries, attachments, radii in m
    ("tape measure everywhere", 1e-3, 1e-3, 5e-4),
    ("tape on the frame, calliper on the platform", 1e-3, 1e-4, 1e-4),
    ("laser distance meter on the frame, drawing of the platform", 2e-3, 2e-4, 1e-4),
    ("total station on the frame, calliper on the platform", 5e-4, 1e-4, 1e-4),
)
KINDS = {
    "anchor_offset": "every coordinate of every entry point",
    "attachment_offset": "every coordinate of every attachment",
    "pulley_radius": "every pulley radius",
    "pulley_axis": "every pulley's axis, both ways",
    "gravity_tilt": "the vertical, both ways",
}
CORNER_PX = 0.05  # see the table of corners: what tags of 24 px and more give
NOTHING = 1e-6  # in the table's unit: what rounding leaves of a zero
DEGREE = np.pi / 180.0
Rows = list[list[str]]


def _short(value: float, unit: str) -> str:
    if value < NOTHING:
        return f"0 {unit}"
    return f"{value:.2g} {unit}" if value < 100 else f"{value:.0f} {unit}"


def geometry() -> Rows:
    """What a unit of error costs, both examples side by side."""
    found = [(one, numbers.cost_of_geometry(one)) for one in _examples()]
    rows = [["one unit off in", "unit"]]
    for example, _ in found:
        rows[0] += [f"{example.name}: com", "inertia"]
    for kind, words in KINDS.items():
        unit = next(costs[kind][1] for _, costs in found if kind in costs)
        row = [words, unit]
        for example, costs in found:
            row += numbers.in_words(costs[kind][0], example.inertia) if kind in costs else ["–"] * 2
        rows.append(row)
    return rows


def tools() -> Rows:
    """The same for instruments, all their errors together."""
    rows = [["measured with", "cable robot: com", "inertia", "plate: com", "inertia"]]
    found = [(one, numbers.cost_of_geometry(one)) for one in _examples()]
    for name, *sizes in TOOLS:
        row = [name]
        for example, costs in found:
            parts = [
                size / 1e-3 * costs[kind][0]
                for kind, size in zip(list(KINDS)[:3], sizes, strict=True)
                if kind in costs
            ]
            row += numbers.in_words(np.linalg.norm(parts, axis=0), example.inertia)
        rows.append(row)
    return rows


def placement() -> Rows:
    """How well one instant's pose is known, by where the cameras stand."""
    rows = [["cameras, 2 m away", "across the view", "along the view", "tilt of the sheet"]]
    for words, apart in (
        ("one", None),
        ("two, 10° apart", 10 * DEGREE),
        ("two, 30° apart", 30 * DEGREE),
        ("two, 60° apart", 60 * DEGREE),
        ("two, 90° apart", 90 * DEGREE),
    ):
        std = numbers.pose_std(2.0, 0.075, apart, CORNER_PX)
        across, along = 1e3 * max(std[:2]), 1e3 * std[2]
        tilt = 1e3 * max(std[3:5])
        rows.append([words, _short(across, "mm"), _short(along, "mm"), _short(tilt, "mrad")])
    return rows


def exposure() -> Rows:
    """How far the platform moves while the shutter is open."""
    mean, most = numbers.speeds(numbers.cable_robot(), 0.035)
    rows = [["shutter", "moves on average", "at most", "in the picture at 2 m, at most"]]
    for parts in (50, 100, 250, 500, 1000, 2000):
        far = most / parts
        pixels = numbers.FOCAL_PX * far / 2.0
        rows.append(
            [
                f"1/{parts} s",
                _short(1e3 * mean / parts, "mm"),
                _short(1e3 * far, "mm"),
                _short(pixels, "px"),
            ]
        )
    return rows


def clocks() -> Rows:
    """What a wrong clock looks like."""
    mean, most = numbers.speeds(numbers.cable_robot(), 0.035)
    rows = [["two cameras apart by", "see the platform apart by (average)", "at most"]]
    for milliseconds in (0.1, 1.0, 5.0, 20.0):
        late = 1e-3 * milliseconds
        rows.append(
            [
                f"{milliseconds:g} ms",
                _short(1e3 * mean * late, "mm"),
                _short(1e3 * most * late, "mm"),
            ]
        )
    return rows


def tag_sizes() -> Rows:
    """Pixels of a tag's side, and the pose's deviation, by distance."""
    rows = [["side of a tag", *(f"{d} m away" for d in (1, 2, 3, 4))]]
    for side in (0.04, 0.075, 0.11):
        row = [f"{1e3 * side:g} mm"]
        for distance in (1.0, 2.0, 3.0, 4.0):
            pixels = numbers.FOCAL_PX * side / distance
            std = 1e3 * numbers.pose_std(distance, side, 60 * DEGREE, CORNER_PX)
            row.append(
                f"{pixels:.0f} px: {_short(max(std[:3]), 'mm')}, {_short(max(std[3:]), 'mrad')}"
            )
        rows.append(row)
    return rows


def corners() -> Rows:
    """How sharply a tag's corners are found, rendered and looked for."""
    rows = [["side in the picture", "found", "corner off by (rms)"]]
    for side in (12.0, 16.0, 24.0, 32.0, 48.0, 80.0):
        share, error = numbers.corner_error(side)
        told = _short(error, "px") if share else "–"
        rows.append([f"{side:g} px", f"{100 * share:.0f} %", told])
    return rows


def flatness() -> Rows:
    """What a bent sheet does."""
    rows = [["the sheet's edges stand off by", "the frame is off by", "and turned by"]]
    for sag in (1e-4, 1e-3, 3e-3):
        shift, turn = numbers.sag_cost(2.0, 0.075, 60 * DEGREE, sag)
        rows.append([f"{1e3 * sag:g} mm", _short(1e3 * shift, "mm"), _short(1e3 * turn, "mrad")])
    return rows


def amplitudes() -> Rows:
    """Least standard deviations by amplitude, five swings of ten seconds."""
    rows = [["let go at", "cable robot: com", "inertia", "plate: com", "inertia"]]
    for amplitude in (0.005, 0.01, 0.035, 0.07):
        row = [f"{1e3 * amplitude:g} mm"]
        for example in _examples():
            row += numbers.in_words(numbers.bound(example, amplitude, 5, 10.0), example.inertia)
        rows.append(row)
    return rows


def counts() -> Rows:
    """The same by the number of swings, each from another place."""
    rows = [["swings", "cable robot: com", "inertia", "plate: com", "inertia"]]
    for count in (1, 2, 3, 5, 10):
        row = [f"{count}"]
        for example in _examples():
            row += numbers.in_words(numbers.bound(example, 0.035, count, 10.0), example.inertia)
        rows.append(row)
    return rows


def durations() -> Rows:
    """The same by how long each swing is recorded."""
    rows = [["seconds of free swing", "cable robot: com", "inertia", "plate: com", "inertia"]]
    for seconds in (5.0, 10.0, 20.0):
        row = [f"{seconds:g}"]
        for example in _examples():
            row += numbers.in_words(numbers.bound(example, 0.035, 5, seconds), example.inertia)
        rows.append(row)
    return rows


def effects() -> Rows:
    """What an effect is, and what tells it from others, as the program says it."""
    from freeswing.cdpr.effects import catalogue

    rows = [["effect", "what it is", "what tells it from others"]]
    for name, effect in sorted(catalogue().items()):
        if effect.stage == "drive":
            continue
        advice = "; ".join(one.advice for one in sorted(effect.separated_by, key=lambda e: e.rank))
        rows.append([name.replace("_", " "), effect.summary, advice or "–"])
    return rows


def bench_budget() -> Rows:
    """Where an object's deviation comes from on a bench, by what was done about it."""
    from freeswing.excite.bench_plan import BenchCase, deviations

    plain = BenchCase(1.26, 0.04, 0.8, 0.0093, radius_m=0.25, length_m=1.2, known_kg=0.4)
    ways = {
        "tape measure, platform to 50 g": plain,
        "no known mass": replace(plain, known_kg=1e-9),
        "known mass at the radius of gyration": replace(plain, known_at=0.71),
        "platform weighed to 1 g": replace(plain, mass_std_kg=0.001),
        "the same, radii to 0.1 mm": replace(plain, mass_std_kg=0.001, radius_std_m=1e-4),
        "centre of mass unknown to 10 mm": replace(plain, mass_std_kg=0.001, com_std_m=0.01),
    }
    names = ["total", *(name for name in deviations(plain) if name != "total")]
    rows = [["", *names]]
    for words, case in ways.items():
        shares = deviations(case)
        rows.append([words, *(_percent(shares[name] / case.load_izz_kg_m2) for name in names)])
    return rows


def bench_plan() -> Rows:
    """The plan of `excite` for the same bench: the best of each choice, and its neighbours."""
    from freeswing.excite.bench_plan import BenchCase, planned
    from freeswing.excite.bench_table import WORDS

    case = BenchCase(1.26, 0.04, 0.8, 0.0093, radius_m=0.25, length_m=1.2, known_kg=0.4)
    rows = [["", "Izz of the object ±, by value"]]
    for what, words in WORDS.items():
        mine = [row for row in planned(case)[1] if row.what == what]
        told = [f"{row.value:g}: {_percent(row.percent / 100)}" for row in mine]
        marked = [f"**{one}**" if row.best else one for one, row in zip(told, mine, strict=True)]
        rows.append([words, ", ".join(marked)])
    return rows


def _percent(share: float) -> str:
    return f"{100.0 * share:.2f} %"


def _examples() -> tuple[numbers.Example, numbers.Example]:
    return numbers.cable_robot(), numbers.string_plate()


# Page, function; those that take seconds come with a test of the slow tier.
QUICK: dict[str, tuple[str, Callable[[], Rows]]] = {
    "placement": ("guide/cameras.md", placement),
    "tag-sizes": ("guide/tags.md", tag_sizes),
    "flatness": ("guide/tags.md", flatness),
    "bench-budget": ("guide/bench.md", bench_budget),
    "bench-plan": ("guide/bench.md", bench_plan),
}
LONG: dict[str, tuple[str, Callable[[], Rows]]] = {
    "effects": ("guide/verdicts.md", effects),
    "geometry": ("guide/measuring.md", geometry),
    "tools": ("guide/measuring.md", tools),
    "exposure": ("guide/cameras.md", exposure),
    "clocks": ("guide/cameras.md", clocks),
    "corners": ("guide/tags.md", corners),
    "amplitudes": ("guide/pushing.md", amplitudes),
    "counts": ("guide/runs.md", counts),
    "durations": ("guide/runs.md", durations),
}
TABLES = QUICK | LONG


def markdown(rows: Rows) -> str:
    """A table, its first row the heading."""
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([lines[0], "|" + " --- |" * len(rows[0]), *lines[1:]])


def in_page(name: str) -> str:
    """The table as its page holds it."""
    page = (DOCS / TABLES[name][0]).read_text(encoding="utf-8")
    found = re.search(_pattern(name), page, re.DOTALL)
    if found is None:
        raise SystemExit(f"{TABLES[name][0]}: no table {name}")
    return found[1].strip()


def _pattern(name: str) -> str:
    return rf"<!-- table {name} -->\n(.*?)<!-- end -->"


def write(name: str) -> None:
    """Compute a table and put it into its page."""
    page, make = TABLES[name]
    path = DOCS / page
    text = path.read_text(encoding="utf-8")
    table = f"<!-- table {name} -->\n{markdown(make())}\n<!-- end -->"
    new, count = re.subn(_pattern(name), lambda _: table, text, flags=re.DOTALL)
    if count != 1:
        raise SystemExit(f"{page}: {count} tables {name}, one is expected")
    path.write_text(new, encoding="utf-8")


def main(names: list[str]) -> None:
    """The tables that are named, or all and the pictures."""
    for name in names or TABLES:
        write(name)
        sys.stdout.write(f"{name}\n")
    if not names:
        import guide_pictures

        for one in guide_pictures.write_all(DOCS / "guide"):
            sys.stdout.write(f"{one.name}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
