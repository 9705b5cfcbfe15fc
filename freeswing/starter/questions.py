"""What `freeswing new` asks where a terminal is there; Enter takes what stands in brackets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console
from rich.prompt import Prompt

from freeswing.starter.kinds import KINDS

MEASURED_BY = {
    "cameras": "two or more cameras or phones, printed tags",
    "phone": "one camera or phone, printed tags: less sure across its view",
    "above": "one phone above a bench of two or three strings (trifilar, bifilar), printed tags",
    "mocap": "recordings of motion capture that exist (.trc .c3d .csv .tsv)",
}
MOST_CABLES = 5


@dataclass(frozen=True, slots=True)
class Answers:
    """What a session begins with; None: not said yet.

    Attributes:
        kind: what hangs there, a key of `KINDS`.
        cables: how many.
        mass_kg: of the platform; None also where it was not weighed.
        measured_by: a key of `MEASURED_BY`.
        recordings: of motion capture.
        cameras: their names.
        rate_hz: frames a second.
        tag_m: side of the printed tags.
    """

    kind: str | None = None
    cables: int | None = None
    mass_kg: float | None = None
    measured_by: str | None = None
    recordings: tuple[Path, ...] = ()
    cameras: tuple[str, ...] = ()
    rate_hz: float | None = None
    tag_m: float | None = None


def ask(known: Answers, console: Console | None = None) -> Answers:
    """Ask for what is not known yet.

    Args:
        known: what flags have said.
        console: where the questions go; stderr where None, so that results may be piped.
    """
    there = console or Console(stderr=True)
    kind = known.kind or _choice("What hangs there", {k: v.says for k, v in KINDS.items()}, there)
    cables = known.cables or _cables(kind, there)
    mass = known.mass_kg or _number("Its mass in kg (Enter: not weighed)", there)
    measured_by = known.measured_by or ("mocap" if known.recordings else "")
    measured_by = measured_by or _choice("What measures its swing", MEASURED_BY, there)
    found = replace(known, kind=kind, cables=cables, mass_kg=mass, measured_by=measured_by)
    if measured_by == "mocap":
        return replace(found, recordings=known.recordings or _recordings(there))
    return _of_cameras(found, there)


def _of_cameras(known: Answers, console: Console) -> Answers:
    cameras = known.cameras or (("phone",) if known.measured_by in ("phone", "above") else ())
    while not cameras:
        told = Prompt.ask(
            "Names of the cameras, with commas", default="left,right", console=console
        )
        cameras = tuple(name.strip() for name in told.split(",") if name.strip())
    rate = known.rate_hz or _number("Frames a second", console, 30.0)
    return replace(known, cameras=cameras, rate_hz=rate)


def _choice(question: str, choices: dict[str, str], console: Console) -> str:
    names = list(choices)
    for k, (name, says) in enumerate(choices.items(), start=1):
        console.print(f"  {k}  {name}: {says}", markup=False, highlight=False)
    numbers = [str(k) for k in range(1, len(names) + 1)]
    told = Prompt.ask(
        question, choices=[*numbers, *names], show_choices=False, default="1", console=console
    )
    return names[int(told) - 1] if told in numbers else told


def _cables(kind: str, console: Console) -> int:
    usual = KINDS[kind].cables
    if not KINDS[kind].any_count:
        return usual
    told = _number("On how many cables", console, float(usual))
    while told is None or told not in range(1, MOST_CABLES + 1):
        console.print(f"  1 to {MOST_CABLES}: more leave no free motion", highlight=False)
        told = _number("On how many cables", console, float(usual))
    return int(told)


def _number(question: str, console: Console, usual: float | None = None) -> float | None:
    """A number above zero; Enter gives what is usual."""
    while True:
        default = "" if usual is None else f"{usual:g}"
        told = Prompt.ask(question, default=default, show_default=bool(default), console=console)
        if not told:
            return usual
        try:
            value = float(told.replace(",", "."))
        except ValueError:
            value = math.nan
        if math.isfinite(value) and value > 0.0:
            return value
        console.print(f"  {told!r} is not a number above 0", markup=False, highlight=False)


def _recordings(console: Console) -> tuple[Path, ...]:
    while True:
        told = Prompt.ask("Recordings (files, or a pattern such as day1/*.trc)", console=console)
        found = files_of(told.split())
        if found:
            return found
        console.print(f"  {told!r}: no such file", markup=False, highlight=False)


def files_of(words: Sequence[str]) -> tuple[Path, ...]:
    """The files that words or patterns name."""
    found: list[Path] = []
    for word in words:
        path = Path(word).expanduser()
        there = [path] if path.is_file() else sorted(path.parent.glob(path.name))
        found += [one for one in there if one.is_file()]
    return tuple(dict.fromkeys(found))
