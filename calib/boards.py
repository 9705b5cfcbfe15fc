"""Calibration boards: their numbers, corner coordinates and Kalibr's yaml.

Board frame: x along the columns, y along the rows as the corners are counted, origin at the
middle of the corners, z = 0 on the print. Corners are numbered as the detectors report them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calib.camera_models import Array
from calib.tag_patterns import tag_dictionary
from cdpr.documents import InputError, read_text

KINDS = ("charuco", "chessboard", "aprilgrid")
_MOST_YAML_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class Board:
    """One planar board.

    Attributes:
        kind: `charuco`, `chessboard` or `aprilgrid`.
        columns: squares across (charuco), inner corners across (chessboard) or tags across.
        rows: the same downwards.
        square_m: side of a square, or of an AprilGrid's tag.
        marker_m: side of a ChArUco marker; gap between AprilGrid tags; 0 for a chessboard.
        dictionary: family of the markers, empty for a chessboard.
        legacy: ChArUco layout of OpenCV before 4.6.
    """

    kind: str
    columns: int
    rows: int
    square_m: float
    marker_m: float = 0.0
    dictionary: str = ""
    legacy: bool = False

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"board kind {self.kind!r} is not one of {', '.join(KINDS)}")
        least = 1 if self.kind == "aprilgrid" else 3
        if min(self.columns, self.rows) < least:
            raise ValueError(
                f"a {self.kind} of {self.columns} x {self.rows}: needs at least {least} x {least}"
            )
        if not (np.isfinite(self.square_m) and self.square_m > 0.0):
            raise ValueError(f"board: square side is {self.square_m} m, must be above 0")
        if self.kind == "charuco" and not 0.0 < self.marker_m < self.square_m:
            raise ValueError(
                f"board: marker_m is {self.marker_m}, must lie between 0 and {self.square_m}"
            )
        if self.kind == "aprilgrid" and not self.marker_m > 0.0:
            raise ValueError(f"board: the gap between tags is {self.marker_m} m, must be above 0")

    @property
    def points_m(self) -> Array:
        """Corners in the board frame, (n, 3)."""
        if self.kind == "aprilgrid":
            plane = self._grid_corners()
        else:
            less = 1 if self.kind == "charuco" else 0
            plane = _lattice(self.columns - less, self.rows - less) * self.square_m
        plane = plane - 0.5 * (plane.min(axis=0) + plane.max(axis=0))
        return np.column_stack([plane, np.zeros(len(plane))])

    @property
    def lattice(self) -> np.ndarray:
        """Column and row of every corner, whole numbers, (n, 2)."""
        if self.kind == "aprilgrid":
            tag = _lattice(self.columns, self.rows).astype(int)[:, None, :]
            return (2 * tag + np.array([[0, 1], [1, 1], [1, 0], [0, 0]])).reshape(-1, 2)
        less = 1 if self.kind == "charuco" else 0
        return _lattice(self.columns - less, self.rows - less).astype(int)

    @property
    def edges(self) -> np.ndarray:
        """Pairs of neighbouring corners, whose distance is known, (m, 2)."""
        step = np.abs(self.lattice[:, None] - self.lattice[None]).sum(axis=-1)
        first, second = np.nonzero(np.triu(step == 1))
        return np.column_stack([first, second])

    def _grid_corners(self) -> Array:
        """Tag corners TL TR BR BL; id 0 bottom left, ids along x, y upwards (Kalibr)."""
        pitch = self.square_m + self.marker_m
        origin = _lattice(self.columns, self.rows)[:, None, :] * pitch
        corners = self.square_m * np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]])
        return (origin + corners).reshape(-1, 2)


def _lattice(columns: int, rows: int) -> Array:
    """Column and row of lattice points, row by row, (columns * rows, 2)."""
    grid = np.meshgrid(np.arange(columns, dtype=float), np.arange(rows, dtype=float))
    return np.stack(grid, axis=-1).reshape(-1, 2)


def board_from(table: Mapping[str, object]) -> Board:
    """A board from the `board` table of session.toml or from Kalibr's yaml keys.

    Kalibr counts chessboard corners as targetCols, targetRows and its AprilGrid as tagCols,
    tagRows, tagSize, tagSpacing (a ratio of tagSize).

    Raises:
        InputError: when a number is missing or makes no board.
    """
    kind = str(table.get("kind", table.get("target_type", "")))
    kind = "chessboard" if kind == "checkerboard" else kind
    try:
        if kind == "aprilgrid":
            size = _number(table, "tagSize")
            gap = _number(table, "tagSpacing") * size
            family = str(table.get("family", "tag36h11"))
            tag_dictionary(family)
            columns, rows = int(_number(table, "tagCols")), int(_number(table, "tagRows"))
            return Board(kind, columns, rows, size, gap, family)
        if kind == "chessboard" and "targetCols" in table:
            columns, rows = int(_number(table, "targetCols")), int(_number(table, "targetRows"))
            return Board(kind, columns, rows, _number(table, "rowSpacingMeters"))
        squares = table.get("squares")
        if not isinstance(squares, list | tuple) or len(squares) != 2:
            raise ValueError(f"squares is {squares!r}, expected two whole numbers")
        columns, rows = int(squares[0]), int(squares[1])
        square = _number(table, "square_m")
        if kind == "chessboard":
            return Board(kind, columns, rows, square)
        family = str(table.get("dictionary", ""))
        tag_dictionary(family)
        legacy = table.get("legacy") is True
        return Board(kind, columns, rows, square, _number(table, "marker_m"), family, legacy)
    except ValueError as error:
        raise InputError(f"board: {error}") from error


def read_board(path: Path | str) -> Board:
    """A board from Kalibr's target yaml (`target_type: aprilgrid` or `checkerboard`).

    Raises:
        InputError: unreadable, or keys missing.
    """
    text = read_text(path, _MOST_YAML_BYTES)
    entries = re.findall(r"^\s*(\w+)\s*:\s*['\"]?([^#'\"\n]*?)['\"]?\s*(?:#.*)?$", text, re.M)
    try:
        return board_from(dict(entries))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _number(table: Mapping[str, object], key: str) -> float:
    value = table.get(key)
    if isinstance(value, str | int | float) and not isinstance(value, bool):
        number = float(value)
        if np.isfinite(number):
            return number
    raise ValueError(f"{key} is {value!r}, expected a finite number")
