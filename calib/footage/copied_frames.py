"""Frames that only repeat the one before, told by what changed, and how many are too many.

A recorder that runs faster than its source repeats frames; a lossy codec then stores a copy as
"nothing changed", which is not quite the same numbers.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

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


_LARGEST = 255.0  # change of a grey value


def largest_change(
    before: Image, image: Image, enough: float = _LARGEST, first: int = 0
) -> tuple[float, tuple[int, int]]:
    """Mean absolute change of the tile that changed most, and its row and column.

    Args:
        before: grey, (h, w).
        image: the frame after it.
        enough: a tile that changed by so much ends the search, whatever the others did.
        first: the row of tiles to begin with.
    """
    pixels = (_TILE // 2) ** 2
    enough = math.ceil(enough * pixels)
    most, row, column = largest_tile_change(before, image, _TILE, enough, first)
    return float(most) / pixels, (int(row), int(column))


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


def tile_shift_px(before: Image, image: Image, tile: tuple[int, int]) -> float:
    """How far the edges of the tile in this row and column went: no more than the largest."""
    near = tuple(
        slice(max(_TILE * at - 1, 0), min(_TILE * (at + 1) + 1, size // _TILE * _TILE))
        for at, size in zip(tile, image.shape, strict=True)
    )
    inner = tuple(slice(min(at, 1), min(at, 1) + _TILE) for at in tile)
    old = before[near].astype(np.float32)
    change = (image[near].astype(np.float32) - old)[inner]
    down, right = (np.asarray(slope)[inner] for slope in np.gradient(old))
    steep = float((down**2 + right**2).sum())
    if not steep > (_TILE * _EDGE_GREY) ** 2:
        return 0.0
    return math.hypot(float((down * change).sum()), float((right * change).sum())) / steep


@dataclass(slots=True)
class _Change:
    """From the frame before to a frame: a copy is told by the whole of it, others by less.

    Attributes:
        before: the frame before; None where there is none.
        image: the frame.
        least: the change is at least so large.
        tile: row and column of a tile that changed so much.
        is_whole: whether that is the change.
    """

    before: Image | None
    image: Image
    least: float
    tile: tuple[int, int]
    is_whole: bool

    def whole(self) -> float:
        """The change, which is looked for now if it was not."""
        if not self.is_whole and self.before is not None:
            self.least, self.is_whole = largest_change(self.before, self.image)[0], True
        return self.least


def with_copies(frames: Iterable[Frame]) -> Iterator[tuple[Frame, bool]]:
    """Every frame, and whether it only repeats the one before; two frames are looked ahead.

    The first `WARM_UP` frames after any other start than the recording's may be judged otherwise.
    """
    held: deque[tuple[Frame, _Change]] = deque()  # not yet given, and their changes
    past: deque[_Change] = deque(maxlen=_AROUND)  # changes of the frames given
    before: Image | None = None
    tile = 0, 0  # where much changed, much will
    for frame in frames:
        change, enough = np.inf, COPY_SHARE * _LARGEST
        if before is not None:
            change, tile = largest_change(before, frame[2], enough, tile[0])
        held.append((frame, _Change(before, frame[2], change, tile, change < enough)))
        before = frame[2]
        if len(held) > _AROUND:
            yield _judged(held, past)
    while held:
        yield _judged(held, past)


WARM_UP = _AROUND + 1


def _judged(held: deque[tuple[Frame, _Change]], past: deque[_Change]) -> tuple[Frame, bool]:
    frame, own = held.popleft()
    around = [one for one in (*past, *(one for _, one in held)) if one.before is not None]
    past.append(own)
    if own.before is None or not own.is_whole or own.least == 0.0:
        return frame, own.least == 0.0
    if tile_shift_px(own.before, frame[2], own.tile) >= COPY_SHIFT_PX:
        return frame, False  # whatever is around
    usual = max((one.least for one in around), default=0.0)
    if not own.least < COPY_SHARE * usual:
        usual = max((one.whole() for one in around), default=0.0)
    alike = usual > _LEAST_GREY and own.least < COPY_SHARE * usual
    return frame, alike and largest_shift_px(own.before, frame[2]) < COPY_SHIFT_PX


def are_many(copies: int, frames: int) -> bool:
    """Whether so many copies among so many frames are worth a word."""
    return copies > MOST_COPIES * frames
