"""Printed planes for the renderer: tags, calibration boards and plain patches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.tags.tag_patterns import tag_cells, tag_dictionary

Array = NDArray[np.float64]
Parent = Literal["base", "platform"]


@dataclass(frozen=True, slots=True)
class Patch:
    """A flat printed rectangle, its frame that of a tag: centre, x right, y up, z to the viewer.

    Attributes:
        cells: reflectance 0 ... 1 of equal cells, row 0 on top, (R, C).
        size_m: width and height.
        T_parent_patch: patch to parent coordinates, (4, 4).
        parent: `base` stands still, `platform` moves.
        shown_s: base-time intervals in which the patch is there; None = always.
        layer: all of a lower layer is drawn before, whatever its distance: walls are behind things.
    """

    cells: Array
    size_m: tuple[float, float]
    T_parent_patch: Array = field(default_factory=lambda: np.eye(4))
    parent: Parent = "platform"
    shown_s: tuple[tuple[float, float], ...] | None = None
    layer: int = 0

    def moved(self, T_parent_patch: Array, parent: Parent) -> Patch:
        """The same patch elsewhere."""
        return replace(self, T_parent_patch=np.array(T_parent_patch, float), parent=parent)


@dataclass(frozen=True, slots=True)
class Sphere:
    """A bright ball: a retro-reflective marker lit from the camera."""

    position_m: Array
    diameter_m: float
    parent: Parent = "platform"
    reflectance: float = 1.2


def tag_patch(
    family: str,
    tag_id: int,
    size_m: float,
    T_parent_tag: Array | None = None,
    parent: Parent = "platform",
    quiet_cells: int = 1,
) -> Patch:
    """A tag whose black border has the side `size_m`, on a white rim of `quiet_cells`."""
    cells = tag_cells(family, tag_id)
    sheet = np.pad(cells.astype(float), quiet_cells, constant_values=1.0)
    side = size_m * sheet.shape[0] / cells.shape[0]
    pose = np.eye(4) if T_parent_tag is None else T_parent_tag
    return Patch(sheet, (side, side), np.array(pose, float), parent)


def plain_patch(
    reflectance: float,
    size_m: tuple[float, float],
    T_parent_patch: Array,
    parent: Parent = "base",
    shown_s: tuple[tuple[float, float], ...] | None = None,
) -> Patch:
    """A patch of one grey, for instance something that hides a tag for a while."""
    return Patch(np.full((1, 1), reflectance), size_m, T_parent_patch, parent, shown_s)


def charuco_patch(
    squares: Sequence[int],
    square_m: float,
    marker_m: float,
    dictionary: str,
    margin_squares: float = 0.5,
    *,
    legacy: bool = False,
) -> Patch:
    """A ChArUco board as OpenCV prints it: `squares` are columns and rows of squares.

    In the layout of OpenCV before 4.6 (`legacy`) a board of an even count of rows begins with a
    marker, not with a black square.
    """
    cells_side = tag_dictionary(dictionary).markerSize + 2
    ratio = Fraction(marker_m / square_m).limit_denominator(64)
    side = _common_side([ratio / cells_side, (1 - ratio) / 2, Fraction(1, 2)])
    board = cv2.aruco.CharucoBoard(
        (int(squares[0]), int(squares[1])), square_m, marker_m, tag_dictionary(dictionary)
    )
    board.setLegacyPattern(legacy)
    sheet = _checker(squares, side, first_black=not legacy or int(squares[1]) % 2 == 1)
    marker = round(ratio * side)
    inset = (side - marker) // 2
    for tag_id, corners in zip(np.ravel(board.getIds()), board.getObjPoints(), strict=True):
        centre = np.asarray(corners)[:, :2].mean(axis=0) / square_m
        column, row = int(centre[0]), int(centre[1])
        cells = np.kron(tag_cells(dictionary, int(tag_id)), np.ones((marker // cells_side,) * 2))
        top, left = row * side + inset, column * side + inset
        sheet[top : top + marker, left : left + marker] = cells
    return _board(sheet, side, square_m, margin_squares)


def chessboard_patch(
    inner_corners: Sequence[int], square_m: float, margin_squares: float = 1.0
) -> Patch:
    """A chessboard of (columns, rows) inner corners, black square top left."""
    squares = (int(inner_corners[0]) + 1, int(inner_corners[1]) + 1)
    return _board(_checker(squares, 2, first_black=True), 2, square_m, margin_squares)


def circles_patch(middles_m: Array, diameter_m: float, cells_across: int = 24) -> Patch:
    """Black circles about middles (n, 2), y downwards; cells on the outline are grey by area."""
    cell = diameter_m / cells_across
    low, high = middles_m.min(axis=0) - diameter_m, middles_m.max(axis=0) + diameter_m
    columns, rows = np.ceil((high - low) / cell).astype(int)
    centre = 0.5 * (low + high)
    sheet = np.ones((rows, columns))
    sub = (np.arange(4) + 0.5) / 4.0
    for middle in middles_m:
        at = (middle - centre) / cell + 0.5 * np.array([columns, rows])
        first = np.maximum(np.floor(at - 0.5 * cells_across).astype(int) - 1, 0)
        last = first + cells_across + 3
        x = (np.arange(first[0], last[0])[:, None] + sub).ravel() - at[0]
        y = (np.arange(first[1], last[1])[:, None] + sub).ravel() - at[1]
        inside = (x[None] ** 2 + y[:, None] ** 2 < (0.5 * cells_across) ** 2).astype(float)
        share = inside.reshape(len(y) // 4, 4, len(x) // 4, 4).mean(axis=(1, 3))
        sheet[first[1] : last[1], first[0] : last[0]] -= share
    return Patch(sheet, (columns * cell, rows * cell))


def aprilgrid_patch(
    tag_columns: int,
    tag_rows: int,
    tag_size_m: float,
    tag_spacing: float,
    family: str = "tag36h11",
    border_cells: int = 2,
) -> Patch:
    """Kalibr's AprilGrid: id 0 bottom left, ids along x, black squares between tag corners."""
    cells_side = tag_cells(family, 0, border_cells).shape[0]
    gap_ratio = Fraction(tag_spacing).limit_denominator(64)
    side = _common_side([Fraction(1, cells_side), gap_ratio])
    gap = round(gap_ratio * side)
    pitch = side + gap
    height, width = tag_rows * pitch + gap, tag_columns * pitch + gap
    sheet = np.ones((height, width))
    for row in range(tag_rows + 1):
        for column in range(tag_columns + 1):
            top, left = row * pitch, column * pitch
            sheet[top : top + gap, left : left + gap] = 0.0
    for row in range(tag_rows):
        for column in range(tag_columns):
            tag_id = (tag_rows - 1 - row) * tag_columns + column
            cells = tag_cells(family, tag_id, border_cells)
            top, left = row * pitch + gap, column * pitch + gap
            sheet[top : top + side, left : left + side] = np.kron(
                cells, np.ones((side // cells_side,) * 2)
            )
    return _board(sheet, side, tag_size_m, gap / side)


def _common_side(parts: list[Fraction]) -> int:
    """Cells to a unit so that every part is a whole number of cells."""
    side = 1
    for part in parts:
        side = int(np.lcm(side, part.denominator))
    return side


def _checker(squares: Sequence[int], side: int, *, first_black: bool) -> Array:
    columns, rows = int(squares[0]), int(squares[1])
    parity = np.add.outer(np.arange(rows), np.arange(columns)) % 2
    white = parity == 1 if first_black else parity == 0
    return np.kron(white.astype(float), np.ones((side, side)))


def _board(sheet: Array, side: int, unit_m: float, margin_units: float) -> Patch:
    margin = max(1, round(margin_units * side))
    whole = np.pad(sheet, margin, constant_values=1.0)
    cell_m = unit_m / side
    return Patch(whole, (whole.shape[1] * cell_m, whole.shape[0] * cell_m))
