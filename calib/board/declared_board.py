"""Calibration boards: their numbers, corner coordinates and Kalibr's yaml.

Board frame: x along the columns, y along the rows as the corners are counted, origin at the
middle of the corners, z = 0 on the print. A ChArUco board and an AprilGrid are known by the corners
of their tags, four a tag, TL TR BR BL; a chessboard by its inner corners, a grid of circles by
their middles, row by row.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from freeswing.calib.camera.lens_models import Array
from freeswing.calib.tags.tag_patterns import tag_dictionary
from freeswing.cdpr.files.documents import InputError, read_text

CIRCLES = ("circles", "asymmetric_circles")
KINDS = ("charuco", "chessboard", "aprilgrid", *CIRCLES)
_MOST_YAML_BYTES = 1 << 20
SIDE_KEYS = {"aprilgrid": "tagSize"}  # what files call the side; else square_m
LARGEST_SQUARE_M = 1.0
"""A board that a person can wave has squares of 10 to 200 mm."""


@dataclass(frozen=True, slots=True)
class Board:
    """One planar board.

    Attributes:
        kind: `charuco`, `chessboard`, `aprilgrid`, `circles` or `asymmetric_circles`.
        columns: squares (charuco), inner corners (chessboard), tags or circles across.
        rows: the same downwards.
        square_m: side of a square, or of an AprilGrid's tag; from a circle to the next, of an
            asymmetric grid from a row to the next, in which they stand two such steps apart.
        marker_m: side of a ChArUco marker; gap between AprilGrid tags; diameter of a circle; 0 for
            a chessboard.
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
        if self.square_m > LARGEST_SQUARE_M:
            raise ValueError(
                f"{SIDE_KEYS.get(self.kind, 'square_m')} is {self.square_m:g} m: lengths are in "
                f"metres, {1e-3 * self.square_m:g} if these are millimetres"
            )
        if self.kind == "charuco" and not 0.0 < self.marker_m < self.square_m:
            raise ValueError(
                f"board: marker_m is {self.marker_m}, must lie between 0 and {self.square_m}"
            )
        if self.kind == "aprilgrid" and not self.marker_m > 0.0:
            raise ValueError(f"board: the gap between tags is {self.marker_m} m, must be above 0")
        if self.kind in CIRCLES and not 0.0 < self.marker_m < self._nearest_m:
            raise ValueError(
                f"board: diameter_m is {self.marker_m}, must lie between 0 and the distance of two "
                f"circles, {self._nearest_m:.6g}"
            )

    @property
    def _nearest_m(self) -> float:
        """From a circle to the nearest other."""
        return self.square_m * (np.sqrt(2.0) if self.kind == "asymmetric_circles" else 1.0)

    @property
    def has_tags(self) -> bool:
        """Whether it is known by tags that tell which they are."""
        return self.n_tags > 0

    @property
    def points_m(self) -> Array:
        """Corners in the board frame, (n, 3)."""
        plane = {
            "charuco": self._charuco_corners,
            "chessboard": self._inner_corners,
            "circles": self._inner_corners,
            "asymmetric_circles": self._shifted_rows,
            "aprilgrid": self._grid_corners,
        }[self.kind]()
        plane = plane - 0.5 * (plane.min(axis=0) + plane.max(axis=0))
        return np.column_stack([plane, np.zeros(len(plane))])

    @property
    def n_tags(self) -> int:
        """Tags on the board, their ids being 0 ... n_tags - 1."""
        if self.kind == "aprilgrid":
            return self.columns * self.rows
        return self.columns * self.rows // 2 if self.kind == "charuco" else 0

    @property
    def edges(self) -> np.ndarray:
        """Pairs of corners near each other, whose distance is known, (m, 2)."""
        if not self.has_tags:
            index = np.arange(self.columns * self.rows).reshape(self.rows, self.columns)
            right = np.stack([index[:, :-1].ravel(), index[:, 1:].ravel()], axis=-1)
            down = np.stack([index[:-1].ravel(), index[1:].ravel()], axis=-1)
            return np.concatenate([right, down])
        tag = 4 * np.arange(self.n_tags)
        sides = [np.stack([tag + k, tag + (k + 1) % 4], axis=-1) for k in range(4)]
        across = [np.stack([tag[:-1] + k, tag[1:] + k], axis=-1) for k in range(4)]
        pairs = np.concatenate(sides + across)
        points = self.points_m
        level = np.abs(points[pairs[:, 0], 1] - points[pairs[:, 1], 1]) < 1.01 * self.square_m
        return pairs[level]

    def _inner_corners(self) -> Array:
        return _lattice(self.columns, self.rows) * self.square_m

    def _shifted_rows(self) -> Array:
        column, row = _lattice(self.columns, self.rows).T
        return np.column_stack([2.0 * column + row % 2.0, row]) * self.square_m

    def _charuco_corners(self) -> Array:
        """Marker corners as OpenCV lays the markers out, y downwards, (4 n_tags, 2)."""
        import cv2

        dictionary = tag_dictionary(self.dictionary)
        size = (self.columns, self.rows)
        board = cv2.aruco.CharucoBoard(size, self.square_m, self.marker_m, dictionary)
        board.setLegacyPattern(self.legacy)
        middles = [np.mean(corners, axis=0)[:2] for corners in board.getObjPoints()]
        # OpenCV holds single precision: put the middles back on the lattice
        middle = np.repeat(np.floor(np.array(middles) / self.square_m) + 0.5, 4, axis=0)
        middle = middle * self.square_m
        turn = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        return middle + self.marker_m * np.tile(turn, (len(middle) // 4, 1))

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

    Kalibr counts chessboard corners and circles as targetCols, targetRows and its AprilGrid as
    tagCols, tagRows, tagSize, tagSpacing (a ratio of tagSize); diameter_m it does not know.

    Raises:
        InputError: when a number is missing or makes no board.
    """
    kind = str(table.get("kind", table.get("target_type", "")))
    kind = "chessboard" if kind == "checkerboard" else kind
    try:
        if kind == "circlegrid":
            skewed = str(table.get("asymmetricGrid", "")).lower() in ("1", "true")
            columns, rows = int(_number(table, "targetCols")), int(_number(table, "targetRows"))
            step, across = _number(table, "spacingMeters"), _number(table, "diameter_m")
            return Board(CIRCLES[skewed], columns, rows, step, across)
        if kind == "aprilgrid":
            size = _number(table, "tagSize")
            gap = _number(table, "tagSpacing") * size
            family = str(table.get("family", "tag36h11"))
            tag_dictionary(family)
            columns, rows = int(_number(table, "tagCols")), int(_number(table, "tagRows"))
            return _of_its_tags(Board(kind, columns, rows, size, gap, family))
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
        if kind in CIRCLES:
            return Board(kind, columns, rows, square, _number(table, "diameter_m"))
        family = str(table.get("dictionary", ""))
        tag_dictionary(family)
        legacy = table.get("legacy") is True
        board = Board(kind, columns, rows, square, _number(table, "marker_m"), family, legacy)
        return _of_its_tags(board)
    except ValueError as error:
        raise InputError(f"board: {error}") from error


def _of_its_tags(board: Board) -> Board:
    """The board where its dictionary has so many tags."""
    known = tag_dictionary(board.dictionary).bytesList.shape[0]
    if board.n_tags > known:
        raise ValueError(
            f"{board.columns} by {board.rows} need {board.n_tags} tags, {board.dictionary} has "
            f"{known}: check its counts and its dictionary"
        )
    return board


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
