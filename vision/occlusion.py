"""Which tags of a platform hide parts of each other from a camera.

Tags on a concave or stepped platform come to stand before each other at grazing angles. A strip a
pixel wide over the border of a narrow tag moves its corners by half a pixel while most of the
pattern still fits, so such a tag is left out by what is known: layout and pose.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
        found = np.zeros(len(self.read_m), dtype=bool)
        if not len(self.pairs):
            return found
        behind, before = self.pairs.T
        read = (self.read_m @ rotation.T + position)[behind]
        plate = (self.whole_m @ rotation.T + position)[before]
        covered = _covers(plate, _edge_points(read)).any(axis=1)
        np.logical_or.at(found, behind, covered)
        return found


def _widened(corners_m: Array, factors: Array) -> Array:
    centres = corners_m.mean(axis=1, keepdims=True)
    return centres + (corners_m - centres) * factors[:, None, None]


def _edge_points(corners: Array) -> Array:
    """Points along the edges of squares (m, 4, 3), (m, 4 k, 3)."""
    share = (np.arange(_EDGE_POINTS) / _EDGE_POINTS)[:, None]
    ways = np.roll(corners, -1, axis=1) - corners
    points = corners[:, :, None] + share * ways[:, :, None]
    return points.reshape(len(corners), -1, 3)


def _covers(plates: Array, points: Array) -> NDArray[np.bool_]:
    """Whether plates (m, 4, 3) stand before points (m, k, 3) as seen from the origin, (m, k)."""
    corner = plates[:, 3]
    right, up = plates[:, 2] - corner, plates[:, 0] - corner
    normals = np.cross(right, up)
    with np.errstate(divide="ignore", invalid="ignore"):
        height = np.einsum("ma,ma->m", normals, corner)[:, None]
        scale = height / np.einsum("ma,mka->mk", normals, points)
        place = points * scale[..., None] - corner[:, None]
        u = np.einsum("mka,ma->mk", place, right) / np.sum(right**2, axis=1)[:, None]
        v = np.einsum("mka,ma->mk", place, up) / np.sum(up**2, axis=1)[:, None]
        return (scale > 0.0) & (scale < 1.0) & (u > 0) & (u < 1) & (v > 0) & (v < 1)
