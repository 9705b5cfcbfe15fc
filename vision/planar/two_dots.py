"""Two dots of which nothing is known as two uncalibrated signals, and the block that names them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.vision.planar.dots import Spots

Array = NDArray[np.float64]

COLUMNS = ("dot1_px", "dot2_px")


@dataclass(frozen=True, slots=True)
class DotSignals:
    """A run's two signals.

    Attributes:
        values_px: each dot's way across the line that joins them, NaN where unseen, (n, 2).
        std_px: (n, 2).
        direction: of that way in the image, (2,).
        apart_px: between the dots.
    """

    values_px: Array
    std_px: Array
    direction: Array
    apart_px: float


def dot_signals(
    dots: NDArray[np.int64], spots: Spots, focal_px: float, direction: Array | None = None
) -> DotSignals:
    """How far two dots go across the line that joins them: what yaw does most.

    Args:
        dots: index of each dot's spot by frame, (2, n).
        spots: their places, in rays of a lens of `focal_px`.
        focal_px: pixels to a ray's unit.
        direction: as another run by the same camera had it; None: of this run. Gains that all runs
            share need the same direction in all of them.

    Source:
        Goldstein, Poole, Safko 2002, Classical Mechanics, sec. 4.9: a turn moves points across the
        line to its axis.
    """
    places = np.full((2, dots.shape[1], 2), np.nan)
    noise = np.full((2, dots.shape[1]), np.nan)
    for k, dot in enumerate(dots):
        there = dot >= 0
        places[k, there] = focal_px * spots.rays[dot[there]]
    line = np.nanmean(places[1] - places[0], axis=0)
    apart = float(np.linalg.norm(line))
    if direction is None:
        direction = np.array([-line[1], line[0]]) / apart
    for k, dot in enumerate(dots):
        there = dot >= 0
        spread = spots.covariances[dot[there]]
        noise[k, there] = focal_px * np.sqrt(np.einsum("i,nij,j->n", direction, spread, direction))
    return DotSignals((places @ direction).T, noise.T, np.asarray(direction), apart)


def channel_block() -> str:
    """What session.toml needs for the two signals, ready to paste."""
    lines = []
    for k, column in enumerate(COLUMNS, start=1):
        lines += [
            "[[channels]]",
            f'name = "dot{k}"',
            f'column = "{column}"',
            'coordinates = ["chi", "x", "y"]',
            "order = 3",
            "",
        ]
    return "\n".join(lines)
