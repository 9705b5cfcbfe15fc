"""Bench recordings as CSV: any part of a pose, and uncalibrated channels beside it or alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from freeswing.cdpr.files.documents import InputError, Problems
from freeswing.cdpr.files.noise_columns import (
    POSE_NOISE,
    QUATERNION,
    QUATERNION_NOISE,
    correlation_names,
    noise_names,
)
from freeswing.cdpr.files.number_table import (
    check_times,
    check_width,
    read_lines,
    read_numbers,
)
from freeswing.cdpr.files.trajectory_csv import column_name, lines_of, pose_values, question_unit
from freeswing.cdpr.robot import POSE_COORDINATES, Array

_PLACE = ("x_m", "y_m", "z_m")


@dataclass(frozen=True, slots=True)
class SignalTable:
    """A recording's columns.

    Attributes:
        times_s: (n,), increasing.
        values: by coordinate (x .. chi) or channel column, (n,) each, NaN where empty.
        stds: of those that have a `std_` column, (n,) each.
        notes: what was taken for a gap, one sentence each.
    """

    times_s: Array
    values: dict[str, Array]
    stds: dict[str, Array]
    notes: tuple[str, ...] = ()


def header_of(path: Path | str) -> tuple[str, ...]:
    """The names of a CSV file's columns.

    Raises:
        InputError: when there is no text in it.
    """
    lines = read_lines(path)
    separator = ";" if ";" in lines[0] else ","
    check_width(path, 1, lines[0], separator)
    header = tuple(cell.strip().strip("\"'") for cell in lines[0].split(separator))
    while header and not header[-1]:
        header = header[:-1]
    return header


def coordinates_in(header: tuple[str, ...]) -> tuple[str, ...]:
    """The pose coordinates that a header holds, all six for poses with quaternions."""
    if set(QUATERNION) <= set(header):
        return POSE_COORDINATES
    return tuple(name for name in POSE_COORDINATES if column_name(name) in header)


def read_signals(path: Path | str, channels: tuple[str, ...] = ()) -> SignalTable:
    """Read a bench recording.

    Args:
        path: the file.
        channels: names of the session's channel columns, of which the file may hold any.

    Raises:
        InputError: naming file, line, column and remedy.
    """
    header = header_of(path)
    coordinates = coordinates_in(header)
    held = tuple(name for name in channels if name in header)
    _check_header(path, header, coordinates, held, channels)
    lines = read_lines(path)
    separator = ";" if ";" in lines[0] else ","
    rows = enumerate(lines[1:], start=2)
    table = read_numbers(path, rows, separator, header, decimal_comma=separator == ";")
    check_times(path, table, header.index("t_s"), "t_s")
    columns = {name: table.values[:, place] for place, name in enumerate(header)}
    if QUATERNION[0] in header:
        poses, notes = pose_values(path, table, columns)
        values: dict[str, Array] = {c: poses[:, k] for k, c in enumerate(POSE_COORDINATES)}
        stds = {
            c: columns[n]
            for c, n in zip(values, noise_names(POSE_NOISE), strict=True)
            if n in columns
        }
    else:
        values, notes = {name: columns[column_name(name)] for name in coordinates}, ()
        stds = {
            name: columns[f"std_{column_name(name)}"]
            for name in coordinates
            if f"std_{column_name(name)}" in columns
        }
        question_unit(path, values)
    for name in held:
        values[name] = columns[name]
        if f"std_{name}" in columns:
            stds[name] = columns[f"std_{name}"]
    for name, std in stds.items():
        known = np.isfinite(values[name])
        if not (std[known] > 0.0).all():
            raise InputError(f"{path}: std of {name}: every one must be > 0; or leave it out")
    return SignalTable(columns["t_s"], values, stds, notes)


def signal_pieces(table: SignalTable) -> Iterator[bytes]:
    """Channel columns as CSV in pieces, each with its noise where that is known."""
    header, parts = ["t_s"], [table.times_s]
    for name, values in table.values.items():
        header.append(name)
        parts.append(values)
    for name, std in table.stds.items():
        header.append(f"std_{name}")
        parts.append(std)
    return lines_of(header, np.column_stack(parts))


def _check_header(
    path: Path | str,
    header: tuple[str, ...],
    coordinates: tuple[str, ...],
    held: tuple[str, ...],
    channels: tuple[str, ...],
) -> None:
    problems = Problems()
    is_pose = QUATERNION[0] in header
    plain = (*_PLACE, *QUATERNION) if is_pose else tuple(map(column_name, coordinates))
    noise = POSE_NOISE if is_pose else coordinates
    known = {"t_s", *plain, *held, *(f"std_{name}" for name in held)}
    known |= {*noise_names(noise), *correlation_names(noise), *QUATERNION_NOISE}
    for name in header:
        if header.count(name) > 1:
            problems.add(f"line 1: {name[:40]!r}", f"{header.count(name)} columns of this name")
        elif name not in known:
            allowed = ["t_s", *map(column_name, POSE_COORDINATES), *QUATERNION, *channels]
            problems.add(f"line 1: {name[:40]!r}", f"unknown column; known: {', '.join(allowed)}")
    if "t_s" not in header:
        problems.add("line 1: t_s", "missing column")
    if not coordinates and not held:
        problems.add("line 1", "neither a coordinate nor a channel of session.toml is in it")
    problems.raise_if_any(path)
