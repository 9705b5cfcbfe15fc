"""Boards and tags as SVG sheets at their true size."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def sheet_svg(cells: Array, size_m: tuple[float, float], label: str) -> str:
    """A printed plane of equal cells (R, C), 0 black and 1 white, `size_m` wide and high.

    The label stands below the print with its width, to be checked with a ruler.
    """
    rows, columns = cells.shape
    width_mm, height_mm = 1e3 * size_m[0], 1e3 * size_m[1]
    bars = "".join(_bars(cells < 0.5))
    text_mm = max(3.0, 0.02 * height_mm)
    total_mm = height_mm + 3.0 * text_mm
    scale = f"scale({width_mm / columns:.9g} {height_mm / rows:.9g})"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width_mm:.6g}mm" '
        f'height="{total_mm:.6g}mm" viewBox="0 0 {width_mm:.9g} {total_mm:.9g}">\n'
        f'<rect width="100%" height="100%" fill="white"/>\n'
        f'<path transform="{scale}" fill="black" d="{bars}"/>\n'
        f'<text x="{width_mm / 2:.6g}" y="{height_mm + 2 * text_mm:.6g}" text-anchor="middle" '
        f'font-family="sans-serif" font-size="{text_mm:.4g}">{label}; this sheet is '
        f"{width_mm:.6g} mm wide: print at 100 % and measure it</text>\n</svg>\n"
    )


def _bars(black: NDArray[np.bool_]) -> Iterator[str]:
    """Runs of black cells as rectangles; equal rows below one another are one rectangle."""
    row = 0
    while row < len(black):
        height = 1
        while row + height < len(black) and (black[row + height] == black[row]).all():
            height += 1
        edges = np.flatnonzero(np.diff(np.concatenate([[0], black[row].astype(int), [0]])))
        for start, end in edges.reshape(-1, 2):
            yield f"M{start} {row}h{end - start}v{height}h{start - end}z"
        row += height
