"""Numbers in separated text, with the line named where something is wrong."""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import read_text
from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.files.unit_quaternions import wrong_recorded

Array = NDArray[np.float64]

MOST_TEXT_BYTES = 64 * 2**20
MOST_ROWS = 2_000_000
MOST_COLUMNS = 4000
LARGEST_NUMBER = 1e12
MISSING = ("", "nan", "-nan", "+nan", "na", "n/a", "null")


@dataclass(frozen=True, slots=True)
class NumberTable:
    """Rows of numbers (n_rows, n_columns), NaN where a cell is empty, and their line numbers."""

    values: Array
    lines: NDArray[np.intp]


def read_lines(path: Path | str) -> list[str]:
    """Lines of a text file whatever its line ends; the first one has index 0.

    Raises:
        InputError: when it cannot be read, is not UTF-8 text or is larger than the limits.
    """
    text = read_text(path, MOST_TEXT_BYTES).replace("\r\n", "\n").replace("\r", "\n")
    n_rows = text.count("\n")
    if n_rows > MOST_ROWS:
        raise InputError(f"{path}: {n_rows} lines, more than the {MOST_ROWS} read here: cut it")
    return text.split("\n")


def comma_separated(text: str) -> str:
    """CSV text with commas between cells, also of spreadsheets that write 0,5;1,2 for 0.5,1.2.

    The header decides: with semicolons and without commas in it, they separate the cells.
    """
    header = text.lstrip("\ufeff").split("\n", 1)[0]
    if ";" not in header or "," in header:
        return text
    return text.replace(",", ".").replace(";", ",")


def check_width(path: Path | str, number: int, line: str, separator: str) -> None:
    """Refuse a header of more columns than any recording has.

    Raises:
        InputError: naming the line.
    """
    n_columns = line.count(separator) + 1
    if n_columns > MOST_COLUMNS:
        raise InputError(
            f"{path}: line {number}: {n_columns} columns, more than the {MOST_COLUMNS} read here"
        )


def read_numbers(
    path: Path | str,
    lines: Iterable[tuple[int, str]],
    separator: str | None,
    columns: tuple[str, ...],
    *,
    decimal_comma: bool = False,
) -> NumberTable:
    """Read (line number, text) rows of exactly `columns`; blank lines are skipped.

    Empty cells at the end of a row beyond the columns are ignored.

    Raises:
        InputError: naming file, line and column of a wrong row or number.
    """
    values, numbers = array("d"), array("q")
    for number, line in lines:
        if not line.strip():
            continue
        cells = line.split(separator, MOST_COLUMNS)
        if len(cells) != len(columns):
            cells = _of_right_number(path, number, cells, columns, decimal_comma=decimal_comma)
        if decimal_comma:
            cells = [cell.replace(",", ".") for cell in cells]
        try:
            row = [float(cell) for cell in cells]
        except ValueError:
            row = [_number(path, number, *pair) for pair in zip(cells, columns, strict=True)]
        if "_" in line:
            raise InputError(f"{path}: line {number}: {line[:60]!r} is not a row of numbers")
        values.extend(row)
        numbers.append(number)
    table = np.array(values, dtype=np.float64).reshape(-1, len(columns))
    result = NumberTable(table, np.array(numbers, dtype=np.intp))
    _check_finite(path, result, columns)
    return result


def check_times(path: Path | str, table: NumberTable, column: int, name: str) -> None:
    """Check that a column is known in every row and increases.

    Raises:
        InputError: naming the line.
    """
    times = table.values[:, column]
    if len(times) == 0:
        raise InputError(f"{path}: holds no sample; record again or name another file")
    unknown = np.flatnonzero(np.isnan(times))
    if len(unknown):
        raise InputError(f"{path}: line {table.lines[unknown[0]]}: {name} is empty")
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if len(late):
        i = int(late[0])
        raise InputError(
            f"{path}: line {table.lines[i + 1]}: {name} is {times[i + 1]:.9g} after "
            f"{times[i]:.9g}; times must increase: sort the rows and drop repeated ones"
        )


def known_poses(
    path: Path | str, table: NumberTable, positions: Array, q: Array, order: str
) -> tuple[Array, Array, tuple[str, ...]]:
    """Poses whose turn is known, NaN elsewhere, and what was taken for a gap, one sentence each.

    0 0 0 0 is no turn: programs write it where the platform was not seen. Its position is none
    either. `order` is the file's.

    Returns:
        Positions (n, 3), quaternions (n, 4) of length 1, and the sentences.

    Raises:
        InputError: naming the line of one that has another length, or where all are zero.

    Source:
        Siciliano, Sciavicco, Villani, Oriolo 2009, Robotics, sec. 2.6: unit quaternions.
    """
    zero = (q == 0.0).all(axis=1)
    is_gap = zero & bool(np.isfinite(q[~zero]).all(axis=1).any())
    result = np.where(is_gap[:, None], np.nan, q)
    norm = np.linalg.norm(result, axis=1)
    wrong = np.flatnonzero(wrong_recorded(norm))
    if len(wrong):
        raise InputError(
            f"{path}: line {table.lines[wrong[0]]}: the quaternion's length is "
            f"{norm[wrong[0]]:.4g}, must be 1 (order {order})"
        )
    positions = np.where(np.isfinite(norm)[:, None], positions, np.nan)
    if not is_gap.any():
        return positions, result, ()
    first = table.lines[int(np.argmax(is_gap))]
    samples = f"{int(is_gap.sum())} samples" if is_gap.sum() > 1 else "1 sample"
    return (
        positions,
        result,
        (f"the quaternion 0 0 0 0 is taken as a gap in {samples}, first in line {first}",),
    )


def _of_right_number(
    path: Path | str,
    number: int,
    cells: list[str],
    columns: tuple[str, ...],
    *,
    decimal_comma: bool,
) -> list[str]:
    n = len(columns)
    if len(cells) > n and not any(cell.strip() for cell in cells[n:]):
        return cells[:n]
    hint = ""
    if len(cells) == 2 * n and not decimal_comma:
        hint = "; decimal commas? write decimal points, or separate columns with semicolons"
    raise InputError(f"{path}: line {number}: {len(cells)} columns, the header has {n}{hint}")


def _number(path: Path | str, number: int, cell: str, column: str) -> float:
    if cell.strip().lower() in MISSING:
        return float("nan")
    try:
        return float(cell)
    except ValueError as error:
        raise InputError(
            f"{path}: line {number}: {column} is {cell.strip()[:40]!r}, not a number "
            "(leave the cell empty for a missing sample)"
        ) from error


def _check_finite(path: Path | str, table: NumberTable, columns: tuple[str, ...]) -> None:
    rows, cells = np.nonzero(np.abs(table.values) > LARGEST_NUMBER)
    if len(rows):
        raise InputError(
            f"{path}: line {table.lines[rows[0]]}: {columns[cells[0]]} is "
            f"{table.values[rows[0], cells[0]]:.4g}, beyond {LARGEST_NUMBER:g}: check the unit; "
            "leave the cell empty for a missing sample"
        )
