"""Which tags of a platform hide parts of each other from a camera.

Tags on a concave or stepped platform come to stand before each other at grazing angles. A strip a
pixel wide over the border of a narrow tag moves its corners by half a pixel while most of the
pattern still fits, so such a tag is left out by what is known: layout and pose.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.compiled.kernels import kernel

Array = NDArray[np.float64]

_EDGE_POINTS = 6
_RIM_CELLS = 1.0  # a printed plate reaches this far beyond its black square
_READ_CELLS = 0.6  # white rims that merely touch are no harm; what the pattern fit reads is
_LEAST_HEIGHT = 1e-3  # of the plate's side: coplanar tags hide nothing


@dataclass(frozen=True, slots=True)
class Plates:
    """The printed plates of a platform.

    Attributes:
        read_m: corners of what is read of each tag, (n, 4, 3).
        whole_m: corners of each plate, (n, 4, 3).
        pairs: (i, j) where plate j reaches in front of the plane of i, (m, 2).
    """

    read_m: Array
    whole_m: Array
    pairs: NDArray[np.int64]

    @staticmethod
    def of(corners_m: Array, cells: Array) -> Plates:
        """From the black squares' corners TL TR BR BL (n, 4, 3) and cells along a side, (n,)."""
        whole = _widened(corners_m, 1.0 + 2.0 * _RIM_CELLS / cells)
        normals = np.cross(whole[:, 1] - whole[:, 0], whole[:, 0] - whole[:, 3])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        sides = np.linalg.norm(whole[:, 1] - whole[:, 0], axis=1)
        away = whole[None] - whole.mean(axis=1)[:, None, None]
        heights = np.einsum("ia,ijka->ijk", normals, away).max(axis=2)
        reach = heights > _LEAST_HEIGHT * sides[:, None]
        np.fill_diagonal(reach, val=False)
        return Plates(
            _widened(corners_m, 1.0 + 2.0 * _READ_CELLS / cells), whole, np.argwhere(reach)
        )

    def hidden(self, rotation: Array, position: Array) -> NDArray[np.bool_]:
        """Tags of which another plate covers some of the edge, by the platform's pose, (n,).

        Args:
            rotation: R_camera_platform, (3, 3).
            position: of the platform's origin in the camera frame, (3,).
        """
        return _hidden(self.read_m, self.whole_m, self.pairs, rotation, position)


def _widened(corners_m: Array, factors: Array) -> Array:
    centres = corners_m.mean(axis=1, keepdims=True)
    return centres + (corners_m - centres) * factors[:, None, None]


@kernel
def _hidden(
    read: Array, whole: Array, pairs: NDArray[np.int64], rotation: Array, position: Array
) -> NDArray[np.bool_]:
    """Walks along the edges of what is read; see `Plates.hidden`."""
    found = np.zeros(len(read), dtype=np.bool_)
    if len(pairs) == 0:
        return found
    edges, plates = _placed(read, rotation, position), _placed(whole, rotation, position)
    edge_sides, plate_sides = _sides(edges), _sides(plates)
    point = np.empty(3)
    for m in range(len(pairs)):
        i, j = pairs[m]
        if found[i] or _apart(edge_sides, i, plate_sides, j):
            continue
        for k in range(4):
            for step in range(_EDGE_POINTS):
                share = step / _EDGE_POINTS
                for a in range(3):
                    first = edges[i, k, a]
                    point[a] = first + share * (edges[i, (k + 1) % 4, a] - first)
                if _covers(plates[j], point):
                    found[i] = True
    return found


@kernel
def _placed(corners: Array, rotation: Array, position: Array) -> Array:
    """Corners (n, 4, 3) in the camera's frame."""
    placed = np.empty_like(corners)
    for i in range(len(corners)):
        for k in range(4):
            for a in range(3):
                placed[i, k, a] = position[a]
                for b in range(3):
                    placed[i, k, a] += rotation[a, b] * corners[i, k, b]
    return placed


@kernel
def _sides(corners: Array) -> Array:
    """Least and largest x/z and y/z of each four corners, (n, 4); all where one is not ahead."""
    sides = np.empty((len(corners), 4))
    for i in range(len(corners)):
        sides[i, 0] = sides[i, 2] = np.inf
        sides[i, 1] = sides[i, 3] = -np.inf
        for k in range(4):
            if not corners[i, k, 2] > 0.0:
                sides[i, 0] = sides[i, 2] = -np.inf
                sides[i, 1] = sides[i, 3] = np.inf
                break
            x, y = corners[i, k, 0] / corners[i, k, 2], corners[i, k, 1] / corners[i, k, 2]
            sides[i, 0], sides[i, 1] = min(sides[i, 0], x), max(sides[i, 1], x)
            sides[i, 2], sides[i, 3] = min(sides[i, 2], y), max(sides[i, 3], y)
    return sides


@kernel
def _apart(one: Array, i: int, other: Array, j: int) -> bool:
    """Whether two boxes of `_sides` have nothing in common: then neither covers the other."""
    across = one[i, 1] < other[j, 0] or other[j, 1] < one[i, 0]
    return across or one[i, 3] < other[j, 2] or other[j, 3] < one[i, 2]


@kernel
def _covers(plate: Array, point: Array) -> bool:
    """Whether a plate (4, 3) stands before a point (3,), as seen from the origin."""
    corner = plate[3]
    r0, r1, r2 = plate[2, 0] - corner[0], plate[2, 1] - corner[1], plate[2, 2] - corner[2]
    u0, u1, u2 = plate[0, 0] - corner[0], plate[0, 1] - corner[1], plate[0, 2] - corner[2]
    n0, n1, n2 = r1 * u2 - r2 * u1, r2 * u0 - r0 * u2, r0 * u1 - r1 * u0
    along = n0 * point[0] + n1 * point[1] + n2 * point[2]
    if along == 0.0:
        return False
    scale = (n0 * corner[0] + n1 * corner[1] + n2 * corner[2]) / along
    if not 0.0 < scale < 1.0:
        return False
    d0, d1, d2 = (
        point[0] * scale - corner[0],
        point[1] * scale - corner[1],
        point[2] * scale - corner[2],
    )
    right = (d0 * r0 + d1 * r1 + d2 * r2) / (r0 * r0 + r1 * r1 + r2 * r2)
    up = (d0 * u0 + d1 * u1 + d2 * u2) / (u0 * u0 + u1 * u1 + u2 * u2)
    return 0.0 < right < 1.0 and 0.0 < up < 1.0
