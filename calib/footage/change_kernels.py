"""How two frames differ, tile by tile and row by row: exact sums of whole numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel

Image = NDArray[np.uint8]


@kernel
def largest_tile_change(before: Image, image: Image, tile: int) -> int:
    """Largest sum over a tile of the absolute change of every second pixel of every second row."""
    across = image.shape[1] // tile
    sums = np.empty(across, dtype=np.int32)
    line = np.empty(across * tile, dtype=np.int32)
    largest = 0
    for top in range(0, image.shape[0] // tile * tile, tile):
        line[:] = 0
        for v in range(top, top + tile, 2):
            old, new = before[v], image[v]
            for u in range(across * tile):
                line[u] += abs(np.int32(new[u]) - np.int32(old[u]))
        sums[:] = 0
        for k in range(across):
            for u in range(k * tile, (k + 1) * tile, 2):
                sums[k] += line[u]
        largest = max(largest, sums.max())
    return largest


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
