"""[[calibration.base_tags]]: surveyed tags that tie the cameras to the base frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import Reader
from freeswing.cdpr.files.unit_quaternions import declared_quaternion
from freeswing.cdpr.measured.target import (
    LARGEST_TAG_M,
    SMALLEST_M,
    UNIT_CORNERS,
)
from freeswing.cdpr.robot import frozen_array
from freeswing.cdpr.rotation import matrix_from_quaternion

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BaseTag:
    """A surveyed tag fixed to the frame; corners TL TR BR BL in the base frame, (4, 3).

    `std_m` is the stated deviation of its coordinates, None where none is.
    """

    family: str
    id: int
    corners_base_m: Array
    std_m: float | None = None

    def __post_init__(self) -> None:
        corners = frozen_array(self.corners_base_m, (4, 3), "corners_base_m")
        object.__setattr__(self, "corners_base_m", corners)


def read_base_tag(reader: Reader) -> BaseTag | None:
    """A surveyed tag by its four corners, or by its centre, turn and size.

    None where its numbers are wrong, which the reader's problems then say.
    """
    family = reader.string("family")
    number = reader.integer("id", minimum=0)
    points = _by_corners(reader) if "corners_base_m" in reader else _by_centre(reader)
    std = reader.optional_number("std_m", above=0.0)
    reader.finish()
    return None if points is None else BaseTag(family, number, points, std)


def _by_centre(reader: Reader) -> Array | None:
    """Corners of a tag whose centre was measured, (4, 3)."""
    if "centre_base_m" not in reader:
        reader.add("corners_base_m", "missing (or centre_base_m, q_base_tag and size_m)")
        return None
    centre = reader.vector("centre_base_m", 3)
    turn = declared_quaternion(reader, "q_base_tag")
    size = reader.number("size_m", above=SMALLEST_M, maximum=LARGEST_TAG_M)
    if not (np.isfinite(centre).all() and np.isfinite(turn).all() and np.isfinite(size)):
        return None
    corners = size * UNIT_CORNERS[:, :3] @ matrix_from_quaternion(turn).T
    return np.asarray(centre + corners, dtype=np.float64)


def _by_corners(reader: Reader) -> Array | None:
    rows = reader.raw("corners_base_m")
    if rows is None:
        return None
    if not isinstance(rows, list) or len(rows) != 4:
        reader.add("corners_base_m", "must be four points [x, y, z], in the order TL TR BR BL")
        return None
    corner = Reader({str(k): row for k, row in enumerate(rows, 1)}, reader.problems, reader.where)
    points = np.array([corner.vector(str(k), 3) for k in range(1, 5)])
    if not np.isfinite(points).all():
        return None
    sides = np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1)
    diagonals = np.linalg.norm(points[:2] - points[2:], axis=1)
    if diagonals.min() <= sides.max():
        reader.add(
            "corners_base_m",
            f"its sides are {np.round(sides, 4).tolist()} m, its diagonals "
            f"{np.round(diagonals, 4).tolist()} m: no square in the order TL TR BR BL",
        )
    return points
