"""Read wrenches to be distributed, and write what came of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import InputError, replace_file
from freeswing.cdpr.files.number_table import check_width, comma_separated, read_lines, read_numbers
from freeswing.cdpr.files.unit_quaternions import DECLARED_OFF, wrong_declared
from freeswing.cdpr.frozen import freeze
from freeswing.servo.synthesis.state_space import Array

POSE_COLUMNS = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
WRENCH_COLUMNS = ("fx_N", "fy_N", "fz_N", "mx_N_m", "my_N_m", "mz_N_m")
COLUMNS = (*POSE_COLUMNS, *WRENCH_COLUMNS)
# A moment of this many times all tensions at their limit on the longest arm is no moment in N m;
# newton millimetres are 1000 times too large.
MOST_MOMENT = 2.0
# Half the frame, times this: a place so far out is not a slip of the hand but a unit.
MILLIMETRES = 5.0


@dataclass(frozen=True, slots=True)
class WrenchTable:
    """Poses and wrenches, one a row: quaternions of length 1, moments about P, base axes.

    Attributes:
        poses: (k, 7); wrenches: (k, 6).
        lines: line of each row in the file, (k,).
    """

    poses: Array
    wrenches: Array
    lines: NDArray[np.intp]

    def __post_init__(self) -> None:
        freeze(self, "poses", "wrenches", "lines")


def read_wrenches(path: Path | str, reach_m: Array, most_moment_N_m: float) -> WrenchTable:
    """Read and check a wrench file.

    Args:
        path: CSV with `COLUMNS` in any order.
        reach_m: half the frame in x, y, z: what lies outside is refused.
        most_moment_N_m: what all cables at their limits could make at most.

    Raises:
        InputError: naming line and column.
    """
    lines = comma_separated("\n".join(read_lines(path))).split("\n")
    check_width(path, 1, lines[0], ",")
    names = tuple(cell.strip() for cell in lines[0].split(","))
    _check_header(path, names)
    table = read_numbers(path, list(enumerate(lines[1:], start=2)), ",", names)
    if len(table.values) == 0:
        raise InputError(f"{path}: holds no wrench below its header")
    rows, cells = np.nonzero(np.isnan(table.values))
    if len(rows):
        raise InputError(f"{path}: line {table.lines[rows[0]]}: {names[cells[0]]} is empty")
    values = table.values[:, [names.index(name) for name in COLUMNS]]
    _check_rows(path, values, table.lines, reach_m, most_moment_N_m)
    poses = values[:, :7].copy()
    poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    return WrenchTable(poses, values[:, 7:], table.lines)


def _check_header(path: Path | str, names: tuple[str, ...]) -> None:
    missing = [name for name in COLUMNS if name not in names]
    extra = [name for name in names if name not in COLUMNS]
    if not missing and not extra and len(set(names)) == len(names):
        return
    hint = ""
    if any(name.endswith(("mm", "_mm", "Nmm")) or "_N_mm" in name for name in extra):
        hint = "; write metres and newton metres, not mm"
    raise InputError(
        f"{path}: line 1: columns must be {','.join(COLUMNS)}"
        f"{'; missing: ' + ', '.join(missing) if missing else ''}"
        f"{'; not known: ' + ', '.join(extra) if extra else ''}{hint}"
    )


def _check_rows(
    path: Path | str, values: Array, lines: NDArray[np.intp], reach_m: Array, most_moment: float
) -> None:
    outside = np.argwhere(np.abs(values[:, :3]) > reach_m)
    if len(outside):
        row, axis = outside[0]
        far = values[row, axis]
        unit = "; is this in mm? write metres" if abs(far) > MILLIMETRES * reach_m[axis] else ""
        raise InputError(
            f"{path}: line {lines[row]}: {COLUMNS[axis]} is {far:g}, outside the frame of "
            f"+-{reach_m[axis]:.3g} m{unit}"
        )
    norms = np.linalg.norm(values[:, 3:7], axis=1)
    wrong = np.flatnonzero(wrong_declared(norms))
    if len(wrong):
        raise InputError(
            f"{path}: line {lines[wrong[0]]}: the quaternion's length is "
            f"{norms[wrong[0]]:.6g}, must be 1 within {DECLARED_OFF:g}"
        )
    large = np.argwhere(np.abs(values[:, 10:]) > MOST_MOMENT * most_moment)
    if len(large):
        row, axis = large[0]
        raise InputError(
            f"{path}: line {lines[row]}: {COLUMNS[10 + axis]} is {values[row, 10 + axis]:g}, where "
            f"all cables at their limits make less than {most_moment:.3g} N m; is this in N mm? "
            "write N m"
        )


def write_shares(path: Path, names: tuple[str, ...], columns: dict[str, list[object]]) -> None:
    """`T<cable>_N.., I<cable>_A.., status, scale, stopped_by`, one row a wrench."""
    header = [*(f"T{name}_N" for name in names), *(f"I{name}_A" for name in names)]
    header += ["status", "scale", "stopped_by"]
    rows = zip(*[columns[key] for key in header], strict=True)
    text = "\n".join([",".join(header), *(",".join(map(_cell, row)) for row in rows)])
    replace_file(path, f"{text}\n".encode())


def _cell(value: object) -> str:
    if isinstance(value, float):
        return "" if np.isnan(value) else repr(float(value))
    return str(value)
