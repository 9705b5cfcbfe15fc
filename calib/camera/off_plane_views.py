"""Views whose corners are no image of a plane: no board was seen there; dropped by name."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.calib.board.planar_pose import (
    flatness_errors,
)
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.views import Views

# Of the board: one that fills the image is off a plane by 3 % in a fisheye, by 5 at k1 = -0.3.
FLATNESS_LIMIT = 0.06
# Times the usual: a board twice as near is off by two to four times as much.
_FLATNESS_OUTLIER = 8.0
_FLATNESS_FLOOR = 0.01  # a board over a third of the image's width is off by 0.5 to 1 %


@dataclass(frozen=True, slots=True)
class DroppedView:
    """A view left out: where it is, its error and the limit it broke."""

    label: str
    error: float
    limit: float
    unit: str

    def __str__(self) -> str:
        return f"{self.label}: {self.error:.3g} {self.unit} (limit {self.limit:.3g})"


def drop_false_boards(board_points_m: Array, views: Views) -> tuple[Views, tuple[DroppedView, ...]]:
    """Leave out views whose corners are no image of a plane (false detections)."""
    if not len(views):
        return views, ()
    errors = flatness_errors(board_points_m[:, :2], views.pixels)
    usual = float(np.nanmedian(errors))
    limit = min(FLATNESS_LIMIT, max(_FLATNESS_FLOOR, _FLATNESS_OUTLIER * usual))
    bad = ~(errors <= limit)
    dropped = tuple(
        DroppedView(views.label[i], 100.0 * errors[i], 100.0 * limit, "% of the board off a plane")
        for i in np.flatnonzero(bad)
    )
    return views.select(~bad), dropped
