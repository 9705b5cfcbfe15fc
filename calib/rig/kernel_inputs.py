"""What the kernels of the adjustment take: lenses, places, boards and views as plain arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


class Lenses(NamedTuple):
    """Lenses by camera.

    Attributes:
        fisheye: (n_c,).
        full: parameters, (n_c, 12).
        columns: where they stand among a camera's own unknowns, -1: not at all, (n_c, 12).
        counts: how many of them there are, (n_c,).
        first: where a camera's unknowns stand among the shared ones, (n_c,).
    """

    fisheye: Flags
    full: Array
    columns: Ints
    counts: Ints
    first: Ints


class Places(NamedTuple):
    """Rotations (n_c, 3, 3), translations (n_c, 3), clock offsets and line times (n_c, 2)."""

    rotations: Array
    translations: Array
    clocks: Array


class Boards(NamedTuple):
    """T_base_boards (n_pieces, 4, 4) at the pieces' middles, motions (n_pieces, degree, 6)."""

    poses: Array
    motions: Array
    scale_s: float


class Shape(NamedTuple):
    """Board points (n_points, 3), and their derivatives by the shape (n_points, 3, n)."""

    points: Array
    modes: Array


class Estimate(NamedTuple):
    """Everything that a view depends on."""

    lenses: Lenses
    places: Places
    boards: Boards
    shape: Shape


class ViewArrays(NamedTuple):
    """Views of the board.

    Attributes:
        camera: of each view, rising, (n,).
        piece: of the board's motion, (n,).
        pixels: corners, not finite where unseen, (n, n_points, 2).
        lags_s: each view's stamp from the piece's middle, NaN before a board at rest, (n,).
        whitening: lower triangles of each group of corners seen alike, (n, n_groups, 2c, 2c).
    """

    camera: Ints
    piece: Ints
    pixels: Array
    lags_s: Array
    whitening: Array
