"""Textured walls and bodies for the renderer: something to see where no tag is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.render.patterns import Parent, Patch

Array = NDArray[np.float64]

_OCTAVES = (2, 4, 8, 16, 32)  # sizes of the blotches, in cells
# Right, up and outward normal of a box's six faces, in its own axes.
_FACES = (
    ((0, 1, 0), (0, 0, 1), (1, 0, 0)),
    ((0, -1, 0), (0, 0, 1), (-1, 0, 0)),
    ((-1, 0, 0), (0, 0, 1), (0, 1, 0)),
    ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
)


def texture(rows: int, columns: int, seed: int) -> Array:
    """Reflectances 0.1 ... 0.9 of blotches of all sizes, no two places alike, (rows, columns).

    Source:
        Perlin 1985, An Image Synthesizer: noise of many octaves.
    """
    random = np.random.default_rng(seed)
    total = np.zeros((rows, columns))
    for size in _OCTAVES:
        coarse = random.standard_normal((rows // size + 2, columns // size + 2))
        total += np.kron(coarse, np.ones((size, size)))[:rows, :columns]
    total /= np.sqrt(len(_OCTAVES))
    return np.clip(0.5 + 0.25 * total, 0.1, 0.9)


def textured_room(
    size_m: Sequence[float], cell_m: float, seed: int, tile_m: float = 1.0
) -> tuple[Patch, ...]:
    """Walls, floor and ceiling seen from inside, the floor's middle at the base's origin.

    Walls are tiles: one that reaches behind a camera is not drawn, and its neighbours still are.

    Args:
        size_m: along x, y and z.
        cell_m: size of the texture's finest cells.
        seed: decides the texture.
        tile_m: largest side of a tile.
    """
    middle = np.eye(4)
    middle[2, 3] = size_m[2] / 2.0
    faces = _faces(size_m, cell_m, seed, inside=True)
    return tuple(
        tile.moved(middle @ tile.T_parent_patch, "base")
        for face in faces
        for tile in _tiles(face, tile_m)
    )


def textured_box(
    size_m: Sequence[float], cell_m: float, seed: int, parent: Parent = "platform"
) -> tuple[Patch, ...]:
    """A box seen from outside, its middle at the parent's origin."""
    return tuple(
        face.moved(face.T_parent_patch, parent)
        for face in _faces(size_m, cell_m, seed, inside=False)
    )


def _faces(size_m: Sequence[float], cell_m: float, seed: int, *, inside: bool) -> list[Patch]:
    size = np.asarray(size_m, dtype=np.float64)
    faces = []
    for number, axes in enumerate(_FACES):
        right, up, out = (np.array(axis, dtype=np.float64) for axis in axes)
        place = np.eye(4)
        turned = (-right, up, -out) if inside else (right, up, out)
        place[:3, :3] = np.stack(turned, axis=1)
        place[:3, 3] = 0.5 * out * size
        width, height = float(np.abs(right) @ size), float(np.abs(up) @ size)
        rows, columns = round(height / cell_m), round(width / cell_m)
        cells = texture(rows, columns, 10 * seed + number)
        faces.append(Patch(cells, (width, height), place, "base", layer=-1 if inside else 0))
    return faces


def _tiles(face: Patch, tile_m: float) -> list[Patch]:
    """The face in tiles that share a cell with their neighbours, so that no seam is seen."""
    rows, columns = face.cells.shape
    cell = np.array(face.size_m) / (columns, rows)
    step = np.maximum(1, np.round(tile_m / cell)).astype(int)
    tiles = []
    for top in range(0, rows - 1, int(step[1])):
        for left in range(0, columns - 1, int(step[0])):
            cells = face.cells[top : top + step[1] + 1, left : left + step[0] + 1]
            high, wide = cells.shape
            place = np.eye(4)
            place[0, 3] = (left + wide / 2.0 - columns / 2.0) * cell[0]
            place[1, 3] = (rows / 2.0 - top - high / 2.0) * cell[1]
            size = (wide * float(cell[0]), high * float(cell[1]))
            tiles.append(Patch(cells, size, face.T_parent_patch @ place, "base", layer=face.layer))
    return tiles
