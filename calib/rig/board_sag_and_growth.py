"""How far a board may be from its drawing before it was seen: sags, and ink that spreads."""

from __future__ import annotations

import numpy as np

from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.reprojection import board_size, shape_modes

SAG_STD = 0.002
"""Of the board's width. Aluminium and glass keep 0.0003, foam and card on wood 0.001 to 0.005."""
GROWTH_STD = 0.02
"""Of a marker's side: ink spreads by some hundredths, and public boards state theirs 4 % off."""


def shape_std_m(board_points_m: Array) -> Array:
    """How far a board's shape is from its drawing before anything was seen: sags, growth, (3,).

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 3.3: a Gaussian prior; its sizes
        are shares of the board's.
    """
    board_points_m = board_points_m[: board_size(board_points_m)]
    modes = np.abs(shape_modes(board_points_m))
    plane = board_points_m[:, :2]
    extent = np.ptp(plane, axis=0)
    side = 0.0
    if modes[:, :, 2].any():
        tags = plane.reshape(-1, 4, 2)
        side = float(np.linalg.norm(tags[:, 1] - tags[:, 0], axis=1).mean())
    return np.array([*(SAG_STD * extent), GROWTH_STD * side if side else np.inf])
