"""Exports of motion-capture programs as text: Motive and Vicon CSV, Qualisys TSV.

What they share: a few header lines of their own, then one row a frame with three columns a marker.
Each reader finds labels, unit, rate and the first row; the rest is done here once.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.mocap.fill_values import without_gaps
from freeswing.cdpr.files.number_table import (
    check_times,
    read_lines,
    read_numbers,
)
from freeswing.cdpr.files.unit_quaternions import wrong_recorded
from freeswing.cdpr.measured.marker_recording import MarkerRecording
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.rotation import matrix_from_quaternion

METRES_PER_UNIT = {
    "m": 1.0,
    "meters": 1.0,
    "metres": 1.0,
    "cm": 1e-2,
    "centimeters": 1e-2,
    "mm": 1e-3,
    "millimeters": 1e-3,
    "millimetres": 1e-3,
}
Array = NDArray[np.float64]

RATE_TOLERANCE = 1e-3  # of a rate as it is printed; 29.97 for 30 is as much
PRINTED_S = 1e-4  # times have four decimals at least
MOTIVE_MARKERS = ("marker", "rigid body marker", "labeled marker")


@dataclass(frozen=True, slots=True)
class Layout:
    """Where a file has what.

    Attributes:
        separator: between cells.
        width: columns of a row.
        first: index of the first row of numbers.
        markers: label and first column of each marker; x, y, z follow each other.
        metres: per unit of the numbers.
        rate_hz: frames a second.
        time: column of the time in s, None: frame numbers over the rate.
        announced: rows that the header announces, None where it does not.
    """

    separator: str
    width: int
    first: int
    markers: tuple[tuple[str, int], ...]
    metres: float
    rate_hz: float
    time: int | None
    announced: int | None = None


def is_mocap_text(path: Path | str) -> bool:
    """Whether a csv or tsv file is an export of one of these programs, by its first lines."""
    try:
        with Path(path).open("rb") as file:
            head = file.read(4000).decode("utf-8-sig", "replace")
    except OSError:
        return False
    first = head.split("\n", 1)[0].strip().strip('"')
    return first.startswith(("Format Version", "NO_OF_FRAMES")) or re.split("[,;\t]", first)[0] in (
        "Trajectories",
        "Model Outputs",
        "Devices",
    )


def read_mocap_text(path: Path | str) -> MarkerRecording:
    """Read the markers of a Motive or Vicon CSV or a Qualisys TSV export.

    Raises:
        InputError: naming file, line and remedy.
    """
    lines = [line.lstrip("\ufeff") for line in read_lines(path)]
    if lines[0].startswith("Format Version"):
        layout = _motive_head(path, lines).layout
    elif lines[0].startswith("NO_OF_FRAMES"):
        layout = _qualisys(path, lines)
    else:
        layout = _vicon(path, lines)
    values, times = _numbers(path, lines, layout)
    names = tuple(name for name, _ in layout.markers)
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"{path}: label {twice[0]!r} stands twice; labels must differ")
    raw = np.stack([values[:, k : k + 3] for _, k in layout.markers], axis=1)
    positions, notes = without_gaps(raw, names)
    return MarkerRecording(times, names, layout.metres * positions, Path(path).name, notes)


def _numbers(path: Path | str, lines: list[str], layout: Layout) -> tuple[Array, Array]:
    """Values (n_t, width) and times of the rows."""
    columns = tuple(f"column {k + 1}" for k in range(layout.width))
    last = _last_row(lines, layout)
    rows = (
        (number, _padded(lines[number - 1], layout)) for number in range(layout.first + 1, last + 1)
    )
    comma = layout.separator != "," and any("," in line for line in lines[layout.first : last][:2])
    table = read_numbers(path, rows, layout.separator, columns, decimal_comma=comma)
    if layout.announced is not None and layout.announced != len(table.values):
        raise InputError(
            f"{path}: its header announces {layout.announced} frames, but {len(table.values)} rows "
            "follow; the file is cut short or was edited: export it again"
        )
    check_times(path, table, layout.time or 0, "the time" if layout.time else "the frame number")
    stamps = table.values[:, layout.time or 0]
    if layout.time is None:
        return table.values, (stamps - stamps[0]) / layout.rate_hz
    refuse_other_rate(path, stamps, layout.rate_hz)
    return table.values, stamps


def refuse_other_rate(path: Path | str, times: Array, rate_hz: float) -> None:
    """Passes times that step at the rate, frames that are left out apart.

    Raises:
        InputError: where they step at another one.
    """
    steps = np.diff(times)
    steps = steps[steps < 1.5 * np.median(steps)] if len(steps) else steps
    if not len(steps):
        return
    measured = 1.0 / float(steps.mean())
    rounding = 2.0 * PRINTED_S / float(steps.sum())
    if abs(measured / rate_hz - 1.0) > RATE_TOLERANCE + rounding:
        raise InputError(
            f"{path}: its header states {rate_hz:g} Hz, but its times step at {measured:.6g} Hz; "
            "correct the header or export again"
        )


def read_motive_body(path: Path | str) -> Trajectory | None:
    """The pose of a Motive CSV's one rigid body; None where it has markers or is of no Motive.

    Raises:
        InputError: for several bodies, or rotations that are no quaternions.
    """
    lines = [line.lstrip("\ufeff") for line in read_lines(path)]
    if not lines[0].startswith("Format Version"):
        return None
    head = _motive_head(path, lines)
    if head.markers:
        return None
    if len(head.bodies) != 1:
        bodies = ", ".join(name for name, _, _ in head.bodies) or "nothing"
        raise InputError(
            f"{path}: holds no markers and {len(head.bodies)} rigid bodies ({bodies[:100]}); "
            "export the platform's alone, or with its markers"
        )
    name, turn, place = head.bodies[0]
    if turn is None:
        raise InputError(
            f"{path}: rigid body {name}: its rotations are {head.told.get('Rotation Type', '')!r}; "
            "export with Rotation Type Quaternion"
        )
    values, times = _numbers(path, lines, head.layout)
    quaternion = values[:, [turn + 3, turn, turn + 1, turn + 2]]  # Motive writes X Y Z W
    length = np.linalg.norm(quaternion, axis=1)
    if wrong_recorded(length).any():
        off = np.nanmax(np.abs(length - 1.0))
        raise InputError(f"{path}: rigid body {name}: a quaternion's length is off 1 by {off:.3g}")
    positions = head.layout.metres * values[:, place : place + 3]
    R = matrix_from_quaternion(quaternion / length[:, None])
    return Trajectory.from_poses(times, positions, R, None, f"{Path(path).name}: rigid body {name}")


@dataclass(frozen=True, slots=True)
class _MotiveHead:
    """Header of a Motive file; bodies are name, first column of quaternion or None, of position."""

    told: dict[str, str]
    layout: Layout
    bodies: tuple[tuple[str, int | None, int], ...]

    @property
    def markers(self) -> tuple[tuple[str, int], ...]:
        return self.layout.markers


def _motive_head(path: Path | str, lines: list[str]) -> _MotiveHead:
    """Pairs of key and value in line 1, then rows of type, name, id, kind and axis."""
    separator = ";" if lines[0].count(";") > lines[0].count(",") else ","
    cells = [cell.strip() for cell in next(csv.reader(lines[:1], delimiter=separator))]
    told = dict(zip(cells[::2], cells[1::2], strict=False))
    rows: dict[str, list[str]] = {}
    first = 0
    for k, line in enumerate(lines[1:12], start=1):
        row = [cell.strip().strip('"') for cell in line.split(separator)]
        if row[0] == "Frame":
            rows["axes"], first = row, k + 1
            break
        if len(row) > 1 and row[1] in ("Type", "Name"):
            rows[row[1]] = row
        if "Position" in row or "Rotation" in row:
            rows["kinds"] = row
    if set(rows) != {"axes", "Type", "Name", "kinds"} or len({*map(len, rows.values())}) > 1:
        raise InputError(f"{path}: no rows Type, Name, Frame as Motive writes; export it again")
    axes, kinds, types = rows["axes"], rows["kinds"], [t.lower() for t in rows["Type"]]
    places = [
        (rows["Name"][k], k)
        for k in range(2, len(axes) - 2)
        if axes[k : k + 3] == ["X", "Y", "Z"] and kinds[k] == kinds[k + 2] == "Position"
    ]
    markers = [(name, k) for name, k in places if types[k] in MOTIVE_MARKERS]
    bodies = []
    for name, k in places:
        if types[k] == "rigid body":
            is_quaternion = k >= 6 and axes[k - 4 : k] == ["X", "Y", "Z", "W"]
            bodies.append((name, k - 4 if is_quaternion else None, k))
    time = 1 if axes[1].startswith("Time") else None
    if told.get("Coordinate Space", "Global").lower() != "global":
        raise InputError(
            f"{path}: Coordinate Space is {told['Coordinate Space'][:40]!r}: positions relative to "
            "a body that moves itself; export with Coordinate Space Global"
        )
    rate = _rate(path, told.get("Export Frame Rate") or told.get("Capture Frame Rate", ""))
    metres = _metres(path, told.get("Length Units", ""))
    chosen = tuple(_preferred(markers, types))
    frames = _announced(told.get("Total Exported Frames", ""))
    layout = Layout(separator, len(axes), first, chosen, metres, rate, time, frames)
    return _MotiveHead(told, layout, tuple(bodies))


def _preferred(markers: list[tuple[str, int]], types: list[str]) -> list[tuple[str, int]]:
    """Measured markers before those that the program's rigid body puts in their place."""
    measured = [(name, k) for name, k in markers if types[k] != "rigid body marker"]
    return measured if len(measured) >= 3 else markers


def _vicon(path: Path | str, lines: list[str]) -> Layout:
    """Vicon Nexus: the block `Trajectories`, rate, labels every third column, axes, units."""
    at = next((k for k, line in enumerate(lines) if line.startswith("Trajectories")), None)
    if at is None or len(lines) < at + 6:
        raise InputError(f"{path}: no block 'Trajectories'; export the trajectories too")
    separator = max(",;\t", key=lines[at + 3].count)
    rate = _rate(path, lines[at + 1].split(separator)[0])
    labels = [cell.strip() for cell in lines[at + 2].split(separator)]
    axes = [cell.strip() for cell in lines[at + 3].split(separator)]
    units = [cell.strip() for cell in lines[at + 4].split(separator)]
    if axes[:2] != ["Frame", "Sub Frame"]:
        raise InputError(f"{path}: line {at + 4}: must start with Frame and Sub Frame")
    last = len(axes) - 3
    markers = tuple((label, k) for k, label in enumerate(labels) if label and 2 <= k <= last)
    if not markers:
        raise InputError(f"{path}: line {at + 3}: no labels; label the markers and export again")
    metres = _metres(path, units[2] if len(units) > 2 else "")
    return Layout(separator, len(axes), at + 5, markers, metres, rate, None)


def _qualisys(path: Path | str, lines: list[str]) -> Layout:
    """Qualisys: `KEY<tab>value` lines, MARKER_NAMES, an optional line of column names; in mm."""
    told = {}
    first = 0
    for line in lines:
        key, *values = line.split("\t")
        if not key.isupper() and "_" not in key:
            break
        told[key] = [value.strip() for value in values if value.strip()]
        first += 1
    names = told.get("MARKER_NAMES", [])
    if not names:
        raise InputError(f"{path}: no MARKER_NAMES; label the markers and export again")
    before = 0
    cells = lines[first].split("\t") if first < len(lines) else [""]
    if cells[0].strip().lower().startswith("frame"):
        before = 2 if len(cells) > 1 and cells[1].strip().lower().startswith("time") else 1
        first += 1
    elif len([cell for cell in cells if cell.strip()]) == 3 * len(names) + 2:
        before = 2
    rate = _rate(path, " ".join(told.get("FREQUENCY", [])))
    if before == 0:
        lines[first:] = [f"{n}\t{row}" if row else row for n, row in enumerate(lines[first:])]
        before = 1
    markers = tuple((name, before + 3 * k) for k, name in enumerate(names))
    width = before + 3 * len(names)
    frames = _announced(" ".join(told.get("NO_OF_FRAMES", [])))
    return Layout("\t", width, first, markers, 1e-3, rate, 1 if before == 2 else None, frames)


def _last_row(lines: list[str], layout: Layout) -> int:
    """End of the block: a blank line, or the file's end."""
    for k in range(layout.first, len(lines)):
        if not lines[k].strip(layout.separator + " \t"):
            return k
    return len(lines)


def _padded(line: str, layout: Layout) -> str:
    cells = line.count(layout.separator) + 1
    return line + layout.separator * max(layout.width - cells, 0)


def _announced(text: str) -> int | None:
    return int(text) if text.isdigit() else None


def _rate(path: Path | str, text: str) -> float:
    try:
        rate = float(text.replace(",", "."))
    except ValueError:
        rate = 0.0
    if not 0.0 < rate < 1e6:
        raise InputError(f"{path}: the frame rate is {text[:40]!r}, must be a number above 0")
    return rate


def _metres(path: Path | str, text: str) -> float:
    metres = METRES_PER_UNIT.get(text.strip().lower())
    if metres is None:
        known = ", ".join(METRES_PER_UNIT)
        raise InputError(f"{path}: its unit is {text[:40]!r}, must be one of {known}")
    return metres
