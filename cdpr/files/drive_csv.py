"""Recordings of driven robots as CSV: runs, and static poses one a row."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.record import DriveRecord
from freeswing.cdpr.files.documents import InputError, replace_file
from freeswing.cdpr.files.number_table import check_times, comma_separated, read_lines, read_numbers
from freeswing.cdpr.files.unit_quaternions import wrong_recorded

Array = NDArray[np.float64]

POSE_COLUMNS = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
DIGITS = "%.12g"


def run_columns(n: int) -> tuple[str, ...]:
    """The columns of a run with n motors."""
    return (
        "t_s",
        *(f"I{k}_A" for k in range(1, n + 1)),
        *(f"Iref{k}_A" for k in range(1, n + 1)),
        *(f"theta{k}_rad" for k in range(1, n + 1)),
        *POSE_COLUMNS,
    )


def static_columns(n: int) -> tuple[str, ...]:
    """The columns of static poses with n motors."""
    return tuple(name for name in run_columns(n) if name != "t_s" and not name.startswith("Iref"))


def read_drive_run(path: Path | str, n: int) -> DriveRecord:
    """A run of n motors.

    Raises:
        InputError: for other columns, empty cells outside the pose, times that do not increase or
            a quaternion that is none; file, line and column are named.
    """
    table, lines = _read(path, run_columns(n))
    check = _Table(path, table, lines)
    check.full(slice(0, 1 + 3 * n), run_columns(n))
    poses = check.poses(table[:, 1 + 3 * n : 8 + 3 * n])
    currents, references, angles = (table[:, 1 + k * n : 1 + (k + 1) * n] for k in range(3))
    return DriveRecord(table[:, 0], currents, references, angles, poses)


def read_static(path: Path | str, n: int) -> tuple[Array, Array, Array]:
    """Static poses of n motors: currents (n_p, n), angles (n_p, n), poses (n_p, 7).

    Raises:
        InputError: as `read_drive_run`.
    """
    table, lines = _read(path, static_columns(n))
    check = _Table(path, table, lines)
    check.full(slice(0, 2 * n + 7), static_columns(n))
    poses = check.poses(table[:, 2 * n : 2 * n + 7])
    return table[:, :n].copy(), table[:, n : 2 * n].copy(), poses


def write_drive_run(path: Path | str, record: DriveRecord, tensions_N: Array | None = None) -> None:
    """Write a run; with tensions, columns T1_N.. follow, which no command reads."""
    n = record.angles_rad.shape[1]
    names, blocks = list(run_columns(n)), [record.times_s[:, None], record.currents_A]
    blocks += [record.references_A, record.angles_rad, record.poses]
    if tensions_N is not None:
        names += [f"T{k}_N" for k in range(1, n + 1)]
        blocks.append(tensions_N)
    _write(path, names, np.hstack(blocks))


def write_static(path: Path | str, currents: Array, angles: Array, poses: Array) -> None:
    """Write static poses, one a row."""
    _write(path, list(static_columns(currents.shape[1])), np.hstack([currents, angles, poses]))


def _write(path: Path | str, names: list[str], table: Array) -> None:
    rows = [",".join(names)]
    rows += [",".join("" if np.isnan(value) else DIGITS % value for value in row) for row in table]
    replace_file(path, ("\n".join(rows) + "\n").encode())


def _read(path: Path | str, wanted: tuple[str, ...]) -> tuple[Array, NDArray[np.intp]]:
    lines = comma_separated("\n".join(read_lines(path))).split("\n")
    found = tuple(cell.strip() for cell in lines[0].split(","))
    missing = [name for name in wanted if name not in found]
    odd = [name for name in found if name not in wanted and not _is_tension(name)]
    twice = sorted({name for name in found if found.count(name) > 1})
    if missing or odd or twice:
        says = [f"lacks {', '.join(missing)}"] if missing else []
        says += [f"has {', '.join(odd[:6])} instead"] if odd else []
        says += [f"has {', '.join(twice[:6])} twice"] if twice else []
        raise InputError(
            f"{path}: line 1: the header must hold {wanted[0]},..,{wanted[-1]}, {len(wanted)} "
            f"columns in any order; it {', '.join(says)}"
        )
    table = read_numbers(path, enumerate(lines[1:], start=2), ",", found)
    if len(table.values) == 0:
        raise InputError(f"{path}: no rows below the header")
    if wanted[0] == "t_s":
        check_times(path, table, found.index("t_s"), "t_s")
    return table.values[:, [found.index(name) for name in wanted]], table.lines


def _is_tension(name: str) -> bool:
    """Whether a column tells a tension, which no command reads."""
    return name[:1] == "T" and name.endswith("_N")


class _Table:
    """Checks of rows that name file and line."""

    def __init__(self, path: Path | str, values: Array, lines: NDArray[np.intp]) -> None:
        self.path, self.values, self.lines = path, values, lines

    def full(self, columns: slice, names: tuple[str, ...]) -> None:
        rows, cells = np.nonzero(np.isnan(self.values[:, columns]))
        if len(rows):
            raise InputError(
                f"{self.path}: line {self.lines[rows[0]]}: {names[columns][cells[0]]} is empty"
            )

    def poses(self, poses: Array) -> Array:
        known = np.isfinite(poses)
        partial = known.any(axis=1) & ~known.all(axis=1)
        norms = np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
        wrong = known.all(axis=1) & wrong_recorded(norms[:, 0])
        for rows, says in (
            (partial, "holds part of a pose; leave all seven cells empty or none"),
            (wrong, "the quaternion's norm is not 1; the order is w x y z"),
        ):
            if rows.any():
                line = self.lines[int(np.argmax(rows))]
                raise InputError(f"{self.path}: line {line}: {says}")
        return np.hstack([poses[:, :3], poses[:, 3:] / norms])
