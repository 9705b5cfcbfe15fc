"""Trajectories as CSV: `t_s,x_m,y_m,z_m,qw,qx,qy,qz` or `t_s` and some coordinates.

An empty cell is a missing sample; optional columns tell the noise (`cdpr.files.noise_columns`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import InputError, Problems, replace_file
from freeswing.cdpr.files.noise_columns import (
    POSE_NOISE,
    QUATERNION,
    QUATERNION_NOISE,
    correlation_names,
    noise_columns,
    noise_names,
    read_noise,
)
from freeswing.cdpr.files.number_table import (
    NumberTable,
    check_times,
    check_width,
    known_poses,
    read_lines,
    read_numbers,
)
from freeswing.cdpr.measured.trajectory import Trajectory, rotation_noise, unwrapped
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.cdpr.rotation import (
    angles_from_matrix,
    matrix_from_quaternion,
    quaternion_from_matrix,
)

Array = NDArray[np.float64]

POSE_COLUMNS = ("x_m", "y_m", "z_m", *QUATERNION)
_ROWS_AT_ONCE = 2000
WIDEST_SWING_RAD = 2.5  # from one side to the other: more than any hanging platform turns freely


def read_csv(path: Path | str, free_coordinates: tuple[str, ...] | None = None) -> Trajectory:
    """Read a CSV trajectory, separated by commas or semicolons (then decimal commas are read too).

    Args:
        path: the file.
        free_coordinates: of the robot; a file without poses must hold these, others are left out.
            None or empty keeps what the file holds.

    Raises:
        InputError: naming file, line, column and remedy.
    """
    lines = read_lines(path)
    separator = ";" if ";" in lines[0] else ","
    check_width(path, 1, lines[0], separator)
    header = tuple(cell.strip().strip("\"'") for cell in lines[0].split(separator))
    while header and not header[-1]:
        header = header[:-1]
    coordinates = _coordinates(path, header)
    rows = enumerate(lines[1:], start=2)
    table = read_numbers(path, rows, separator, header, decimal_comma=separator == ";")
    check_times(path, table, header.index("t_s"), "t_s")
    columns = {name: table.values[:, i] for i, name in enumerate(header)}
    if coordinates is None:
        return _poses(path, table, columns)
    return _selected(path, _plain_coordinates(path, table, columns, coordinates), free_coordinates)


def write_csv(path: Path | str, trajectory: Trajectory) -> None:
    """Write a trajectory as `csv_pieces` gives it; the file is replaced whole."""
    replace_file(path, csv_pieces(trajectory))


def csv_pieces(trajectory: Trajectory) -> Iterator[bytes]:
    """A trajectory as CSV to full precision, in pieces: an hour's text takes a gigabyte.

    Poses are written with quaternions; standard deviations, and correlations other than zero,
    follow when the covariances are known.
    """
    if trajectory.is_pose:
        header = ["t_s", *POSE_COLUMNS]
        quaternions = _continuous(quaternion_from_matrix(trajectory.rotations()))
        parts = [trajectory.times_s[:, None], trajectory.positions(), quaternions]
    else:
        header = ["t_s", *(column_name(name) for name in trajectory.coordinates)]
        parts = [trajectory.times_s[:, None], trajectory.values]
    if trajectory.covariances is not None:
        names, noise = noise_columns(trajectory)
        header += names
        parts.append(noise)
    return lines_of(header, np.concatenate(parts, axis=1))


def lines_of(header: list[str], rows: Array) -> Iterator[bytes]:
    """A table (n, columns) with its header as CSV, some rows at a time."""
    yield (",".join(header) + "\n").encode()
    for first in range(0, len(rows), _ROWS_AT_ONCE):
        part = rows[first : first + _ROWS_AT_ONCE].tolist()
        yield "".join(",".join(map(_cell, row)) + "\n" for row in part).encode()


def column_name(coordinate: str) -> str:
    """Column of a coordinate: x -> x_m, phi -> phi_rad."""
    return f"{coordinate}_m" if coordinate in POSE_COORDINATES[:3] else f"{coordinate}_rad"


def _coordinates(path: Path | str, header: tuple[str, ...]) -> tuple[str, ...] | None:
    """Coordinates of a header, None for poses.

    Raises:
        InputError: naming every wrong column.
    """
    problems = Problems()
    is_pose = any(name in header for name in QUATERNION)
    found = tuple(name for name in POSE_COORDINATES if column_name(name) in header)
    ordered = tuple(sorted(found, key=lambda name: header.index(column_name(name))))
    noise = POSE_NOISE if is_pose else ordered
    known = {"t_s", *(POSE_COLUMNS if is_pose else map(column_name, ordered))}
    known |= {
        *noise_names(noise),
        *correlation_names(noise),
        *(QUATERNION_NOISE if is_pose else ()),
    }
    for name in header:
        if header.count(name) > 1:
            problems.add(f"line 1: {name[:40]!r}", f"{header.count(name)} columns of this name")
        elif name not in known:
            problems.add(f"line 1: {name[:40]!r}", f"unknown column; known: {_known(is_pose)}")
    for name in ("t_s", *(POSE_COLUMNS if is_pose else ())):
        if name not in header:
            problems.add(f"line 1: {name}", "missing column")
    if not is_pose and not found and not problems:
        problems.add("line 1", "no coordinate; the header must be t_s,x_m,y_m or alike")
    problems.raise_if_any(path)
    return None if is_pose else ordered


def _known(is_pose: bool) -> str:
    free = tuple(map(column_name, POSE_COORDINATES))
    return ", ".join(("t_s", *(POSE_COLUMNS if is_pose else free), "std_x_m ..."))


def pose_values(
    path: Path | str, table: NumberTable, columns: dict[str, Array]
) -> tuple[Array, tuple[str, ...]]:
    """The coordinates x .. chi of pose columns, (n, 6), and what was taken for a gap.

    Raises:
        InputError: naming the line of a quaternion that is none.
    """
    position = np.stack([columns[name] for name in POSE_COLUMNS[:3]], axis=1)
    quaternion = np.stack([columns[name] for name in QUATERNION], axis=1)
    position, quaternion, notes = known_poses(
        path, table, position, quaternion, ", ".join(QUATERNION)
    )
    angles = unwrapped(angles_from_matrix(matrix_from_quaternion(quaternion)))
    return np.concatenate([position, angles], axis=1), notes


def _poses(path: Path | str, table: NumberTable, columns: dict[str, Array]) -> Trajectory:
    values, notes = pose_values(path, table, columns)
    is_known = np.asarray(np.isfinite(values).all(axis=1))
    covariances = read_noise(path, table, columns, POSE_NOISE, is_known)
    provenance = f"{Path(path).name}: measured poses"
    parts = columns["t_s"], POSE_COORDINATES, values, covariances, provenance
    return Trajectory(*parts, notes=notes)


def _plain_coordinates(
    path: Path | str,
    table: NumberTable,
    columns: dict[str, Array],
    coordinates: tuple[str, ...],
) -> Trajectory:
    values = np.stack([columns[column_name(name)] for name in coordinates], axis=1)
    question_unit(path, dict(zip(coordinates, values.T, strict=True)))
    is_known = np.asarray(np.isfinite(values).all(axis=1))
    covariances = read_noise(path, table, columns, coordinates, is_known)
    if covariances is not None:
        covariances = rotation_noise(coordinates, values, covariances)
    provenance = f"{Path(path).name}: measured {', '.join(coordinates)}"
    return Trajectory(columns["t_s"], coordinates, values, covariances, provenance)


def question_unit(path: Path | str, columns: Mapping[str, Array]) -> None:
    """Angles of a size that no swing has are questioned by name.

    Args:
        path: the file, for the message.
        columns: values by coordinate, (n,) each.

    Raises:
        InputError: naming file, column, its size and the likely unit.
    """
    for name in POSE_COORDINATES[3:]:
        known = columns[name][np.isfinite(columns[name])] if name in columns else np.zeros(0)
        spread = float(np.ptp(known)) if len(known) else 0.0
        if spread > WIDEST_SWING_RAD:
            raise InputError(
                f"{path}: {column_name(name)} swings over {spread:.3g} rad "
                f"({np.degrees(spread):.0f} degrees), a hanging platform over "
                f"{WIDEST_SWING_RAD:g} at most: is the column in degrees? Write it in radians "
                "(degrees x 0.0174533)"
            )


def _selected(
    path: Path | str, trajectory: Trajectory, wanted: tuple[str, ...] | None
) -> Trajectory:
    is_pose = set(trajectory.coordinates) == set(POSE_COORDINATES)
    if is_pose or not wanted:
        return trajectory.select(POSE_COORDINATES if is_pose else trajectory.coordinates)
    absent = [column_name(name) for name in wanted if name not in trajectory.coordinates]
    if absent:
        needed = ",".join(["t_s", *map(column_name, wanted)])
        raise InputError(
            f"{path}: line 1: {', '.join(absent)} missing; the robot's free coordinates need the "
            f"header {needed}"
        )
    return trajectory.select(wanted)


def _continuous(quaternions: Array) -> Array:
    """Quaternions with signs chosen so that successive known ones do not jump, (n_t, 4)."""
    result = quaternions.copy()
    known = np.flatnonzero(np.isfinite(quaternions).all(axis=1))
    steps = np.sum(quaternions[known][1:] * quaternions[known][:-1], axis=1)
    signs = np.cumprod(np.concatenate([[1.0], np.where(steps < 0.0, -1.0, 1.0)]))
    result[known] *= signs[: len(known), None]
    return result


def _cell(number: float) -> str:
    return "" if number != number else repr(number)
