"""A printed plane with a caption that says how wide it must come out of the printer."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Bar = tuple[int, int, int, int]

READABLE_MM = 3.0
TEXT_SHARE = 0.015  # of the width: readable from where the whole sheet is looked at
MOST_TEXT_SHARE = 0.036  # the caption, some sixty letters, still fits into the width
STRIP_TEXTS = 3.0  # the strip below the print, in heights of its text


@dataclass(frozen=True, slots=True)
class Sheet:
    """What is printed.

    Attributes:
        cells: equal cells, row 0 on top, below 0.5 black, else white, (R, C).
        size_m: width and height of the plane; the caption's strip comes below it.
        label: what it is.
    """

    cells: Array
    size_m: tuple[float, float]
    label: str

    @property
    def width_mm(self) -> float:
        """Width of the plane and of the sheet."""
        return 1e3 * self.size_m[0]

    @property
    def height_mm(self) -> float:
        """Height of the plane alone."""
        return 1e3 * self.size_m[1]

    @property
    def text_mm(self) -> float:
        """Height of the caption's letters."""
        wanted = max(READABLE_MM, TEXT_SHARE * self.width_mm)
        return min(wanted, MOST_TEXT_SHARE * self.width_mm)

    @property
    def total_mm(self) -> float:
        """Height of the plane and the caption's strip."""
        return self.height_mm + STRIP_TEXTS * self.text_mm

    @property
    def caption(self) -> tuple[tuple[float, str], ...]:
        """Two lines, each with the height of its base line from the sheet's top in mm."""
        ruler = f"this sheet is {self.width_mm:.6g} mm wide: print at 100 % and measure it"
        return (
            (self.height_mm + 1.2 * self.text_mm, self.label),
            (self.height_mm + 2.5 * self.text_mm, ruler),
        )

    def bars(self) -> Iterator[Bar]:
        """Column, row, width and height of black rectangles that cover the black cells once."""
        black = self.cells < 0.5
        row = 0
        while row < len(black):
            height = 1
            while row + height < len(black) and (black[row + height] == black[row]).all():
                height += 1
            edges = np.flatnonzero(np.diff(np.concatenate([[0], black[row].astype(int), [0]])))
            for start, end in edges.reshape(-1, 2):
                yield int(start), row, int(end - start), height
            row += height
