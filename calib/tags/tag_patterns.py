"""The printed cells of square fiducial tags, for OpenCV's AprilTag and ArUco families."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

_APRILTAG_NAMES = {
    "tag16h5": "DICT_APRILTAG_16h5",
    "tag25h9": "DICT_APRILTAG_25h9",
    "tag36h10": "DICT_APRILTAG_36h10",
    "tag36h11": "DICT_APRILTAG_36h11",
}


@cache
def tag_dictionary(family: str) -> cv2.aruco.Dictionary:
    """OpenCV's dictionary of a family, named as AprilTag (`tag36h11`) or OpenCV does (`DICT_...`).

    Raises:
        ValueError: when OpenCV knows no such family.
    """
    name = _APRILTAG_NAMES.get(family.lower(), family.upper())
    if not name.startswith("DICT_"):
        name = f"DICT_{name}"
    known = {key.upper(): key for key in dir(cv2.aruco) if key.startswith("DICT_")}
    if name.upper() not in known:
        families = ", ".join([*_APRILTAG_NAMES, *sorted(set(known.values()))])
        raise ValueError(f"tag family {family!r} is not known; one of {families}")
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, known[name.upper()]))


@cache
def tag_cells(family: str, tag_id: int, border_cells: int = 1) -> NDArray[np.uint8]:
    """The tag's cells seen upright, black border included: (n, n), 0 black, 1 white, read-only.

    Raises:
        ValueError: when the family is unknown or has no such id.

    Source:
        Olson 2011, AprilTag: A Robust and Flexible Visual Fiducial System, sec. 4;
        Garrido-Jurado et al. 2014 for ArUco; the codes as OpenCV lists them.
    """
    dictionary = tag_dictionary(family)
    count = dictionary.bytesList.shape[0]
    if not 0 <= tag_id < count:
        raise ValueError(f"tag family {family} has ids 0 to {count - 1}, not {tag_id}")
    side = dictionary.markerSize + 2 * border_cells
    image = dictionary.generateImageMarker(tag_id, side, borderBits=border_cells)
    cells = (image > 127).astype(np.uint8)
    cells.flags.writeable = False
    return cells


@cache
def cut_dictionary(family: str, ids: tuple[int, ...]) -> cv2.aruco.Dictionary:
    """The family cut to the given ids: detection reports the position in `ids`, twice as fast."""
    whole = tag_dictionary(family)
    for tag_id in ids:
        tag_cells(family, tag_id)
    rows = np.ascontiguousarray(whole.bytesList[list(ids)])
    return cv2.aruco.Dictionary(rows, whole.markerSize, whole.maxCorrectionBits)
