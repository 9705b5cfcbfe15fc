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
    plate, corners, point = np.empty((4, 3)), np.empty((4, 3)), np.empty(3)
    for m in range(len(pairs)):
        i, j = pairs[m]
        if found[i]:
            continue
        for k in range(4):
            for a in range(3):
                plate[k, a] = corners[k, a] = position[a]
                for b in range(3):
                    plate[k, a] += rotation[a, b] * whole[j, k, b]
                    corners[k, a] += rotation[a, b] * read[i, k, b]
        for k in range(4):
            for step in range(_EDGE_POINTS):
                share = step / _EDGE_POINTS
                for a in range(3):
                    point[a] = corners[k, a] + share * (corners[(k + 1) % 4, a] - corners[k, a])
                if _covers(plate, point):
                    found[i] = True
    return found


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
