"""How well a camera's views of the board fill its image and vary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.views import Views

GRID = 4  # fields a side, what `LEAST_FILLED` counts: a board at arm's length covers one or two
_SIDES = ("left", "middle", "right")
_HEIGHTS = ("top", "centre", "bottom")


@dataclass(frozen=True, slots=True)
class Coverage:
    """Where and how one camera saw the board.

    Attributes:
        filled: share of the cells of a 4 x 4 grid over the image with a corner in them.
        empty: the thirds of the image without any corner, in words.
        tilt_deg: largest angle between the board's normals of two views.
        distance_ratio: farthest over nearest board.
    """

    filled: float
    empty: tuple[str, ...]
    tilt_deg: float
    distance_ratio: float


def coverage_of(camera: Camera, index: int, views: Views, T_base_boards: Array) -> Coverage:
    """Coverage of camera `index` by its views."""
    own = views.camera == index
    pixels = views.pixels[own]
    seen = pixels[np.isfinite(pixels[..., 0])]
    poses = camera.T_camera_base @ T_base_boards[views.piece[own]]
    normals = poses[:, :3, 2]
    cosines = np.clip(normals @ normals.T, -1.0, 1.0)
    distance = np.linalg.norm(poses[:, :3, 3], axis=1)
    counts = _cells(seen, camera.size_px, 3)
    empty = tuple(f"{_HEIGHTS[row]} {_SIDES[column]}" for row, column in np.argwhere(counts == 0))
    return Coverage(
        filled=float((_cells(seen, camera.size_px, GRID) > 0).mean()),
        empty=empty,
        tilt_deg=float(np.degrees(np.arccos(cosines.min(initial=1.0)))),
        distance_ratio=float(distance.max(initial=1.0) / max(distance.min(initial=1.0), 1e-9)),
    )


def _cells(pixels: Array, size_px: tuple[int, int], count: int) -> np.ndarray:
    """Corners in each cell of a count x count grid over the image, rows first."""
    edges = [np.linspace(-0.5, size - 0.5, count + 1) for size in (size_px[1], size_px[0])]
    histogram, _, _ = np.histogram2d(pixels[:, 1], pixels[:, 0], bins=edges)
    return histogram
