"""Chessboards by OpenCV's sector-based finder, which is slow where there is no board to find.

Looking hard takes seconds an image, and is of use where some images show the board: after a few
without any it is left out until one is found. Where another count of corners is seen again and
again the counts are stated wrong.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.lens_models import Array

Image = NDArray[np.uint8]

MOST_HARD = 3
"""Images without a board in a row that are looked at hard."""
LEAST_ALIKE = 3
"""Images that have to show one other board before it is said."""
_LOOKED_FOR_OTHERS = 8  # images, while none has shown the board: looking for any takes long
_SMALLEST = 3  # inner corners: with two, any four corners are a board
_SEEDS = ((5, 4), (3, 3))


@dataclass(slots=True)
class ChessboardFinder:
    """Finds a chessboard of so many inner corners.

    Attributes:
        columns: inner corners across.
        rows: and down.
    """

    columns: int
    rows: int
    _in_vain: int = field(init=False, default=0)
    _ever: bool = field(init=False, default=False)
    _others: Counter[tuple[int, int]] = field(init=False, default_factory=Counter)

    @property
    def other_counts(self) -> str | None:
        """The counts that images show in place of those stated, in words."""
        if self._ever or not self._others:
            return None
        (across, down), times = self._others.most_common(1)[0]
        if times < LEAST_ALIKE:
            return None
        return (
            f"{times} of {self._in_vain} images show a chessboard of {across} x {down} inner "
            f"corners, session.toml says {self.columns} x {self.rows} (inner corners are where "
            "four squares meet, one fewer each way than squares): correct squares"
        )

    def find(self, image: Image) -> Array | None:
        """Its inner corners row by row, (columns * rows, 2)."""
        size = (self.columns, self.rows)
        hard = cv2.CALIB_CB_EXHAUSTIVE if self._in_vain < MOST_HARD else 0
        flags = cv2.CALIB_CB_ACCURACY + hard
        found, corners = cv2.findChessboardCornersSB(image, size, flags=flags)
        if found and corners is not None:
            self._in_vain, self._ever = 0, True
            return _oriented(image, np.reshape(corners, (*size[::-1], 2)).astype(np.float64))
        self._in_vain += 1
        if not self._ever and self._in_vain <= _LOOKED_FOR_OTHERS:
            other = _counts(image)
            if other is not None and sorted(other) != sorted(size):
                self._others[other] += 1
        return None


def _counts(image: Image) -> tuple[int, int] | None:
    """Inner corners across and down of whatever chessboard an image shows."""
    for seed in _SEEDS:
        found, _, meta = cv2.findChessboardCornersSBWithMeta(image, seed, cv2.CALIB_CB_LARGER)
        if found and meta is not None and min(meta.shape[:2]) >= _SMALLEST:
            rows, columns = meta.shape[:2]
            return max(rows, columns), min(rows, columns)
    return None


def _oriented(image: Image, corners: Array) -> Array:
    """Chessboard corners counted so that the first square is dark and the board is not mirrored.

    A board whose two counts of inner corners are both odd or both even looks the same after half
    a turn; then the detector's own order stays.
    """
    across = corners[0, -1] - corners[0, 0]
    down = corners[-1, 0] - corners[0, 0]
    if across[0] * down[1] - across[1] * down[0] < 0.0:
        corners = corners[::-1]
    rows, columns = corners.shape[:2]
    if (rows + columns) % 2 and _grey(image, corners, 0, 0) > _grey(image, corners, 0, 1):
        corners = corners[::-1, ::-1]
    return np.ascontiguousarray(corners.reshape(-1, 2))


def _grey(image: Image, corners: Array, row: int, column: int) -> float:
    """Mean grey around the middle of the square after inner corner (row, column)."""
    middle = corners[row : row + 2, column : column + 2].mean(axis=(0, 1))
    x, y = np.clip(np.round(middle).astype(int), 1, np.array(image.shape[::-1]) - 2)
    return float(image[y - 1 : y + 2, x - 1 : x + 2].mean())
