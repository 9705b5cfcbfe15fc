"""Marker recordings as TRC: tab-separated text with a unit and a rate in its header."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import InputError, Problems, replace_file
from freeswing.cdpr.files.mocap.fill_values import without_gaps
from freeswing.cdpr.files.number_table import (
    NumberTable,
    check_times,
    check_width,
    read_lines,
    read_numbers,
)
from freeswing.cdpr.measured.marker_recording import MarkerRecording

Array = NDArray[np.float64]

METRES_PER_UNIT = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "meters": 1.0, "millimeters": 1e-3}
HEADER_KEYS = ("DataRate", "NumFrames", "NumMarkers", "Units")
HEADER_LINES = 5
RATE_TOLERANCE = 1e-3  # beside what rounding for print makes; 29.97 for 30 is as much


def read_trc(path: Path | str) -> MarkerRecording:
    """Read a TRC recording; an empty or `nan` cell is a marker that was not seen.

    Raises:
        InputError: naming file, line and remedy, also where header and rows disagree.
    """
    lines = _tabbed(read_lines(path))
    if len(lines) <= HEADER_LINES or not lines[0].lstrip().startswith("PathFileType"):
        raise InputError(f"{path}: line 1: not a TRC file (must start with PathFileType)")
    for number in (2, 3, 4):
        check_width(path, number, lines[number - 1], "\t")
    rate, n_frames, n_markers, scale = _read_header(path, lines)
    names = _read_names(path, lines[3], n_markers)
    columns = ("Frame#", "Time", *(f"{name} {axis}" for name in names for axis in "XYZ"))
    rows = (
        (number, _padded(line, len(columns)))
        for number, line in enumerate(lines[HEADER_LINES:], start=HEADER_LINES + 1)
    )
    decimal_comma = any("," in line for line in lines[HEADER_LINES : HEADER_LINES + 2])
    table = read_numbers(path, rows, "\t", columns, decimal_comma=decimal_comma)
    check_times(path, table, 1, "Time")
    if len(table.values) != n_frames:
        raise InputError(
            f"{path}: line 3: NumFrames is {n_frames}, but {len(table.values)} rows follow; the "
            "file is cut short or was edited: export it again"
        )
    restart = _restart(table)
    times = table.values[:, 1] if restart else _exact_times(path, table, rate, lines)
    raw = table.values[:, 2:].reshape(len(times), n_markers, 3)
    positions, notes = without_gaps(raw, names)
    return MarkerRecording(times, names, scale * positions, Path(path).name, (*restart, *notes))


def write_trc(path: Path | str, recording: MarkerRecording, unit: str = "mm") -> None:
    """Write a TRC file in `unit` (m, cm or mm) to full precision; the file is replaced whole.

    Raises:
        ValueError: for another unit, or a label with a tab or line end in it.
    """
    if unit not in METRES_PER_UNIT:
        raise ValueError(f"unit {unit!r} must be one of {', '.join(METRES_PER_UNIT)}")
    if any(set("\t\r\n") & set(name) or not name.strip() for name in recording.names):
        raise ValueError(f"names: {recording.names} hold an empty one, a tab or a line end")
    steps = np.diff(recording.times_s)
    rate = repr(round(float(1.0 / np.median(steps)), 9)) if len(steps) else "1.0"
    n_t, n_m = len(recording.times_s), len(recording.names)
    axes = "\t".join(f"{axis}{i}" for i in range(1, n_m + 1) for axis in "XYZ")
    header = [
        f"PathFileType\t4\t(X/Y/Z)\t{Path(path).name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
        "OrigNumFrames",
        f"{rate}\t{rate}\t{n_t}\t{n_m}\t{unit}\t{rate}\t1\t{n_t}",
        "Frame#\tTime\t" + "\t\t\t".join(recording.names) + "\t\t",
        f"\t\t{axes}",
        "",
    ]
    values = recording.positions_m.reshape(n_t, -1) / METRES_PER_UNIT[unit]
    rows = (
        "\t".join([str(frame), repr(time), *("" if v != v else repr(v) for v in row)])
        for frame, (time, row) in enumerate(
            zip(recording.times_s.tolist(), values.tolist(), strict=True), start=1
        )
    )
    replace_file(path, "\n".join([*header, *rows, ""]).encode())


def _tabbed(lines: list[str]) -> list[str]:
    """Lines with tabs between cells, also of files that have commas or spaces there."""
    labels = lines[3] if len(lines) > 3 else "\t"
    if "\t" in labels:
        return lines
    if "," in labels:
        return [line.replace(",", "\t") for line in lines]
    return ["\t".join(line.split()) for line in lines]


def _restart(table: NumberTable) -> tuple[str, ...]:
    """What is said where frame numbers do not increase; the Time column then counts alone."""
    back = np.flatnonzero(np.diff(table.values[:, 0]) <= 0.0)
    if not len(back):
        return ()
    line = table.lines[back[0] + 1]
    return (f"frame numbers begin again at line {line}: two takes in one file? Time is used",)


def _read_header(path: Path | str, lines: list[str]) -> tuple[float, int, int, float]:
    """Rate [Hz], frames, markers and metres per unit of lines 2 and 3."""
    cells = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    header = {key.strip(): value.strip() for key, value in cells.items()}
    problems = Problems()
    for key in HEADER_KEYS:
        if not header.get(key):
            problems.add(f"line 2: {key}", "missing in the header or without a value in line 3")
    problems.raise_if_any(path)
    counts = [_count(header[key]) for key in ("NumFrames", "NumMarkers")]
    rate = _positive(header["DataRate"])
    for key, value in (("NumFrames", counts[0]), ("NumMarkers", counts[1]), ("DataRate", rate)):
        if value is None:
            problems.add(f"line 3: {key}", f"{header[key][:40]!r} is not a number above 0")
    scale = METRES_PER_UNIT.get(header["Units"].lower())
    if scale is None:
        units = ", ".join(METRES_PER_UNIT)
        problems.add("line 3: Units", f"{header['Units'][:40]!r} must be one of {units}")
    problems.raise_if_any(path)
    return rate or 0.0, counts[0] or 0, counts[1] or 0, scale or 0.0


def _count(text: str) -> int | None:
    number = _positive(text)
    return int(number) if number is not None and number == int(number) else None


def _positive(text: str) -> float | None:
    try:
        number = float(text.replace(",", "."))
    except ValueError:
        return None
    return number if 0.0 < number < 1e9 else None


def _read_names(path: Path | str, line: str, n_markers: int) -> tuple[str, ...]:
    cells = [cell.strip() for cell in line.split("\t")]
    names = tuple(cell for cell in cells[2:] if cell)
    if cells[:1] != ["Frame#"] or cells[1:2] != ["Time"]:
        raise InputError(f"{path}: line 4: must start with Frame# and Time, separated by tabs")
    if len(names) != n_markers:
        raise InputError(
            f"{path}: line 4: {len(names)} labels ({', '.join(names)[:100]}), but NumMarkers is "
            f"{n_markers} in line 3"
        )
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"{path}: line 4: label {twice[0]!r} stands twice; labels must differ")
    return names


def _padded(line: str, n_columns: int) -> str:
    """The row, with the empty cells put back that editors strip after the last marker seen."""
    n_cells = line.count("\t") + 1
    is_whole_markers = 2 <= n_cells < n_columns and (n_columns - n_cells) % 3 == 0
    return line + "\t" * (n_columns - n_cells) if is_whole_markers else line


def _exact_times(path: Path | str, table: NumberTable, rate: float, lines: list[str]) -> Array:
    """Times on the grid of DataRate where the Time column is that grid, rounded for print."""
    frames, times = table.values[:, 0], table.values[:, 1]
    if len(times) < 2:
        return times
    n_steps = frames[-1] - frames[0]
    n_steps = float(n_steps) if n_steps > 0 else len(times) - 1.0
    measured = n_steps / float(times[-1] - times[0])
    last = lines[int(table.lines[-1]) - 1].split("\t")[1].strip()
    printed = last.replace(",", ".").partition(".")[2]
    digit = 10.0 ** -len(printed) if printed.isdigit() else 0.0
    rounding = 2.0 * digit / float(times[-1] - times[0])
    if abs(measured / rate - 1.0) > RATE_TOLERANCE + rounding:
        raise InputError(
            f"{path}: line 3: DataRate {rate:g}, but the Time column steps at {measured:.6g} Hz; "
            "correct the header or export again"
        )
    grid = times[0] + (frames - frames[0]) / rate
    is_grid = np.isfinite(grid).all() and (np.diff(grid) > 0.0).all()
    return grid if is_grid and np.abs(grid - times).max() <= digit else times
