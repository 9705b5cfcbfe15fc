"""How two frames differ, tile by tile and row by row: exact sums of whole numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel

Image = NDArray[np.uint8]


@kernel
def largest_tile_change(
    before: Image, image: Image, tile: int, enough: int, first: int
) -> tuple[np.int64, np.int64, np.int64]:
    """Largest sum over a tile of the absolute change of every second pixel of every second row.

    And row and column of that tile. Rows are gone through from number `first` on; the first tile
    that changed by `enough` ends the search.
    """
    across, down = image.shape[1] // tile, image.shape[0] // tile
    line = np.empty(across * tile, dtype=np.uint16)  # up to 16 rows of 255
    largest = at_row = at_column = np.int64(0)
    for k in range(down):
        row = (first + k) % down
        line[:] = 0
        for v in range(row * tile, (row + 1) * tile, 2):
            old, new = before[v], image[v]
            for u in range(across * tile):
                change = np.uint8(max(new[u], old[u])) - np.uint8(min(new[u], old[u]))
                line[u] += np.uint16(change)
        for left in range(0, across * tile, tile):
            total = np.int64(0)
            for u in range(left, left + tile, 2):
                total += line[u]
            if total > largest:
                largest, at_row, at_column = total, np.int64(row), np.int64(left // tile)
        if largest >= enough:
            break
    return largest, at_row, at_column


@kernel
def bends(before: Image, image: Image, moved_grey: int) -> tuple[np.int64, np.int64, np.int64]:
    """Pixels that changed by more than `moved_grey`; their bends to the next row and the second.

    The first two and last two rows have no such neighbours and do not count. In a comb the bend to
    the next row is the larger one.
    """
    count = near = far = np.int64(0)
    for v in range(2, image.shape[0] - 2):
        for u in range(image.shape[1]):
            here = np.int64(image[v, u])
            moved = np.int64(abs(here - np.int64(before[v, u])) > moved_grey)
            count += moved
            one = abs(2 * here - np.int64(image[v - 1, u]) - np.int64(image[v + 1, u]))
            two = abs(2 * here - np.int64(image[v - 2, u]) - np.int64(image[v + 2, u]))
            near += moved * one
            far += moved * two
    return count, near, far
