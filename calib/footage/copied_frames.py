"""Frames that only repeat the one before, told by what changed, and how many are too many.

A recorder that runs faster than its source repeats frames; a lossy codec then stores a copy as
"nothing changed", which is not quite the same numbers.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from freeswing.calib.footage.change_kernels import largest_tile_change

Image = NDArray[np.uint8]
Array = NDArray[np.float64]

_TILE = 16
COPY_SHARE = 0.15
"""Change of a copy over that of the frames around it: a lossy codec leaves 0.00 to 0.14 (x264 at
crf 18 to 35). A platform that turns round changes a frame by as little, but its edges move."""
COPY_SHIFT_PX = 0.08
"""Edges of a copy stand still but for the codec (x264: 0.04 px at crf 18; in 95 % of copies less
than this at crf 23). Of 22 frames at which a platform turned round, one moved less: it tells
nothing that the frame before did not."""
MOST_COPIES = 0.03
"""Of the frames looked at: fewer are a platform that turns round, or do not matter."""
_EDGE_GREY = 8.0  # a pixel, mean of a tile: below, noise of some grey values would tell a shift
_LEAST_GREY = 3.0
"""Where no frame around changes by more (mean of some tile), nothing moves: nothing is a copy."""
_AROUND = 2


def largest_change(before: Image, image: Image) -> float:
    """Mean absolute change of the tile that changed most."""
    return largest_tile_change(before, image, _TILE) / (_TILE // 2) ** 2


Frame = tuple[int, str, Image]


def largest_shift_px(before: Image, image: Image) -> float:
    """How far the edges of the tile that moved most went, by the grey values' slope, at most 1."""
    height, width = (size // _TILE * _TILE for size in image.shape)
    old = before[:height, :width].astype(np.float32)
    change = image[:height, :width].astype(np.float32) - old
    down, right = np.gradient(old)
    shape = (height // _TILE, _TILE, width // _TILE, _TILE)

    def of_tiles(values: ArrayLike) -> Array:
        tiles = np.asarray(values).reshape(shape)
        return np.asarray(tiles.sum(axis=(1, 3)), dtype=np.float64)

    steep = of_tiles(down**2 + right**2)
    moved = np.hypot(of_tiles(down * change), of_tiles(right * change))
    told = steep > (_TILE * _EDGE_GREY) ** 2
    return float((moved[told] / steep[told]).max(initial=0.0))


def with_copies(frames: Iterable[Frame]) -> Iterator[tuple[Frame, bool]]:
    """Every frame, and whether it only repeats the one before; two frames are looked ahead.

    The first `WARM_UP` frames after any other start than the recording's may be judged otherwise.
    """
    held: deque[tuple[Frame, Image | None, float]] = deque()  # not yet given, and their changes
    past: deque[float] = deque(maxlen=_AROUND)  # changes of the frames given
    before: Image | None = None
    for frame in frames:
        change = np.inf if before is None else largest_change(before, frame[2])
        held.append((frame, before, change))
        before = frame[2]
        if len(held) > _AROUND:
            yield _judged(held, past)
    while held:
        yield _judged(held, past)


WARM_UP = _AROUND + 1


def _judged(
    held: deque[tuple[Frame, Image | None, float]], past: deque[float]
) -> tuple[Frame, bool]:
    frame, before, change = held.popleft()
    around = [c for c in (*past, *(c for _, _, c in held)) if np.isfinite(c)]
    past.append(change)
    if before is None or change == 0.0:
        return frame, change == 0.0
    usual = max(around, default=0.0)
    alike = usual > _LEAST_GREY and change < COPY_SHARE * usual
    return frame, alike and largest_shift_px(before, frame[2]) < COPY_SHIFT_PX


def are_many(copies: int, frames: int) -> bool:
    """Whether so many copies among so many frames are worth a word."""
    return copies > MOST_COPIES * frames
