"""Whether told probabilities are right: of effects given so much, how many are there.

    python benchmarks/diagnose/reliability.py OUT --figure docs/pictures/reliability.svg

reads every session of OUT (made by sealed_diagnosis.py beside this) that has a result, draws the
share of effects that are there against the probability told, with 95 % intervals (Wilson 1927) and
the number in each bin, and prints the table. Probabilities are those of every fitted candidate, and
of every block of the geometry that cable lengths were asked about.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np

mpl.use("svg")
import matplotlib.pyplot as plt

BINS = (0.0, 0.01, 0.1, 0.5, 0.9, 0.99, 1.0 + 1e-9)
DRAWN = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0 + 1e-9)
NORMAL_95 = 1.96


class Told(NamedTuple):
    """One probability that was told, and whether the effect is there."""

    session: str
    effect: str
    probability: float
    there: bool


class Bin(NamedTuple):
    """The probabilities of one interval: how many, their mean, and the share that is there."""

    low: float
    high: float
    count: int
    told: float
    there: float
    interval: tuple[float, float]


def told_in(folder: Path) -> list[Told]:
    """Every probability of one session's result; none where it has no result."""
    result = folder / "results" / "diagnosis.json"
    if not result.exists():
        return []
    document = json.loads(result.read_text())
    true = {one["effect"]: one for one in _truth(folder)}
    found = [
        Told(folder.name, one["effect"], one["probability"], one["effect"] in true)
        for one in document["candidates"]
        if one.get("probability") is not None
    ]
    for key, chance in document.get("lengths", {}).get("probabilities", {}).items():
        effect, _, part = key.partition(":")
        moved = true.get(effect)
        there = moved is not None and (not part or _part_of(moved) in (None, part))
        found.append(Told(folder.name, f"{key} by lengths", chance, there))
    return found


def _truth(folder: Path) -> list[dict[str, object]]:
    return json.loads((folder / "truth" / "truth.json").read_text())["effects"]


def _part_of(moved: dict[str, object]) -> str | None:
    """Which cable a true effect is about, as keys count; None where it is about all."""
    cable = moved.get("cable")
    return str(cable + 1) if isinstance(cable, int) else None


def binned(told: Sequence[Told], edges: Sequence[float] = BINS) -> list[Bin]:
    """The told probabilities by intervals; empty ones are left out."""
    found = []
    for low, high in pairwise(edges):
        inside = [one for one in told if low <= one.probability < high]
        if inside:
            mean = float(np.mean([one.probability for one in inside]))
            hits, count = sum(one.there for one in inside), len(inside)
            share = hits / count
            found.append(Bin(low, min(high, 1.0), count, mean, share, wilson(hits, count)))
    return found


def wilson(hits: int, count: int) -> tuple[float, float]:
    """95 % interval of a share.

    Source:
        Wilson 1927, Probable inference, the law of succession, and statistical inference.
    """
    z2 = NORMAL_95**2
    centre = (hits + 0.5 * z2) / (count + z2)
    half = NORMAL_95 / (count + z2) * np.sqrt(hits * (count - hits) / count + 0.25 * z2)
    return float(max(0.0, centre - half)), float(min(1.0, centre + half))


def draw(bins: Sequence[Bin], sessions: int, path: Path) -> None:
    """The diagram as SVG."""
    mpl.rcParams["svg.hashsalt"] = "reliability"
    figure, axes = plt.subplots(figsize=(5.0, 4.6), layout="constrained")
    axes.plot([0, 1], [0, 1], color="0.6", linewidth=1.0, label="told = there")
    told, there = (np.array([getattr(one, key) for one in bins]) for key in ("told", "there"))
    reach = np.array([one.interval for one in bins]).T
    off = np.maximum(np.array([there - reach[0], reach[1] - there]), 0.0)
    axes.errorbar(told, there, off, fmt="o", color="#1f4e79", capsize=3, label="95 % (Wilson)")
    for one in bins:
        axes.annotate(str(one.count), (one.told, one.there), (6, 6), textcoords="offset points")
    axes.set_xlabel("probability told")
    axes.set_ylabel("share of effects that are there")
    axes.set_title(f"{sum(one.count for one in bins)} probabilities of {sessions} sealed sessions")
    axes.set_xlim(-0.04, 1.06)
    axes.set_ylim(-0.04, 1.06)
    axes.legend(loc="upper left", frameon=False)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def main(arguments: list[str] | None = None) -> int:
    """Read, print and draw; exit status 2 where no session has a result."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args(arguments)
    by_session = {folder.name: told_in(folder) for folder in sorted(options.out.iterdir())}
    sessions = sum(bool(one) for one in by_session.values())
    told = [one for each in by_session.values() for one in each]
    if not told:
        print(f"no session of {options.out} has results/diagnosis.json", file=sys.stderr)
        return 2
    bins = binned(told)
    print(f"{len(told)} probabilities of {sessions} sessions\n\n| told | how many | mean | there |")
    print("| --- | --- | --- | --- |")
    for one in bins:
        span = f"{one.low:.2f} to {one.high:.2f}"
        reach = f"{one.interval[0]:.2f} to {one.interval[1]:.2f}"
        print(f"| {span} | {one.count} | {one.told:.3f} | {one.there:.3f} ({reach}) |")
    for one in told:
        if (one.probability >= 0.5) != one.there:
            print(f"{one.session}: {one.effect} told {one.probability:.3g}, there: {one.there}")
    if options.figure:
        draw(binned(told, DRAWN), sessions, options.figure)
    return 0


if __name__ == "__main__":
    sys.exit(main())
