"""Finds a calibration board's corners in an image.

Corners follow the convention that pixel (0, 0) is the centre of the top-left pixel; OpenCV 5's
ChArUco detector, chessboard detector and `cornerSubPix` do so already.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from calib.boards import Board
from calib.camera_models import Array
from calib.tag_patterns import tag_dictionary

Image = NDArray[np.uint8]

LEAST_CORNERS = 6
_SUBPIX_STOP = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-4)
_KALIBR_BORDERS = (2, 1)


@dataclass(slots=True)
class BoardDetector:
    """Detector of one board; keeps OpenCV's set-up between images."""

    board: Board
    _charuco: cv2.aruco.CharucoDetector | None = field(init=False, default=None, repr=False)
    _tags: list[cv2.aruco.ArucoDetector] = field(init=False, default_factory=list, repr=False)

    def __post_init__(self) -> None:
        if self.board.kind == "charuco":
            self._charuco = _charuco_detector(self.board)
        if self.board.kind == "aprilgrid":
            count = self.board.columns * self.board.rows
            cut = _first_ids(self.board.dictionary, count)
            self._tags = [_tag_detector(cut, border) for border in _KALIBR_BORDERS]

    def detect(self, image: Image) -> Array | None:
        """Corners (n_points, 2) in pixels, NaN where unseen; None when there is no board."""
        find = {
            "charuco": self._find_charuco,
            "chessboard": self._find_chessboard,
            "aprilgrid": self._find_aprilgrid,
        }[self.board.kind]
        corners = find(image)
        if corners is None or np.isfinite(corners[:, 0]).sum() < LEAST_CORNERS:
            return None
        return None if self._on_one_line(corners) else corners

    def _on_one_line(self, corners: Array) -> bool:
        """Whether all seen corners lie in one row or column, which fixes no pose."""
        lattice = self.board.lattice[np.isfinite(corners[:, 0])].astype(float)
        return bool(np.linalg.matrix_rank(lattice - lattice.mean(axis=0), tol=1e-6) < 2)

    def _find_charuco(self, image: Image) -> Array | None:
        detector = self._charuco
        found, ids, _, _ = detector.detectBoard(image) if detector else (None, None, None, None)
        if found is None or ids is None or len(ids) == 0:
            return None
        corners = np.full((len(self.board.points_m), 2), np.nan)
        corners[np.ravel(ids).astype(int)] = np.reshape(found, (-1, 2))
        return corners

    def _find_chessboard(self, image: Image) -> Array | None:
        size = (self.board.columns, self.board.rows)
        flags = cv2.CALIB_CB_NORMALIZE_IMAGE + cv2.CALIB_CB_ACCURACY
        found, corners = cv2.findChessboardCornersSB(image, size, flags=flags)
        if not found or corners is None:
            return None
        return _oriented(image, np.reshape(corners, (*size[::-1], 2)).astype(float))

    def _find_aprilgrid(self, image: Image) -> Array | None:
        best: Array | None = None
        for detector in self._tags:
            found = self._grid_corners(image, detector)
            if found is not None and (best is None or _count(found) > _count(best)):
                best = found
                if _count(best) >= 2 * LEAST_CORNERS:
                    self._tags = [detector]  # the border is printed one way only
                    break
        return best

    def _grid_corners(self, image: Image, detector: cv2.aruco.ArucoDetector) -> Array | None:
        quads, ids, _ = detector.detectMarkers(image)
        if ids is None:
            return None
        corners = np.full((len(self.board.points_m), 2), np.nan)
        for quad, tag in zip(quads, np.ravel(ids), strict=True):
            raw = np.reshape(quad, (4, 2)).astype(np.float32)
            side = float(np.min(np.linalg.norm(raw - np.roll(raw, 1, axis=0), axis=1)))
            gap = side * self.board.marker_m / self.board.square_m
            reach = int(np.clip(0.5 * gap, 2, 10))
            fine = cv2.cornerSubPix(image, raw.copy(), (reach, reach), (-1, -1), _SUBPIX_STOP)
            moved = np.linalg.norm(fine - raw, axis=1)
            fine = np.where((moved < max(2.0, reach))[:, None], fine, np.nan)
            corners[4 * tag : 4 * tag + 4] = fine
        return corners


def _count(corners: Array) -> int:
    return int(np.isfinite(corners[:, 0]).sum())


def _first_ids(family: str, count: int) -> cv2.aruco.Dictionary:
    """The family cut to ids 0 ... count - 1: OpenCV then decodes several times faster."""
    whole = tag_dictionary(family)
    if count > len(whole.bytesList):
        raise ValueError(f"the board needs {count} tags, {family} has {len(whole.bytesList)}")
    rows = np.ascontiguousarray(whole.bytesList[:count])
    return cv2.aruco.Dictionary(rows, whole.markerSize, whole.maxCorrectionBits)


def opencv_charuco(board: Board) -> cv2.aruco.CharucoBoard:
    """OpenCV's object for a ChArUco board."""
    cut = _first_ids(board.dictionary, board.columns * board.rows // 2)
    size = (board.columns, board.rows)
    result = cv2.aruco.CharucoBoard(size, board.square_m, board.marker_m, cut)
    result.setLegacyPattern(board.legacy)
    return result


def _charuco_detector(board: Board) -> cv2.aruco.CharucoDetector:
    return cv2.aruco.CharucoDetector(
        opencv_charuco(board), cv2.aruco.CharucoParameters(), cv2.aruco.DetectorParameters()
    )


def _tag_detector(cut: cv2.aruco.Dictionary, border_bits: int) -> cv2.aruco.ArucoDetector:
    parameters = cv2.aruco.DetectorParameters()
    parameters.markerBorderBits = border_bits
    parameters.minMarkerPerimeterRate = 0.01
    return cv2.aruco.ArucoDetector(cut, parameters)


def _oriented(image: Image, corners: Array) -> Array:
    """Chessboard corners counted so that the first square is dark and the board is not mirrored.

    A board whose two counts of inner corners are both odd or both even looks the same after half
    a turn; then the detector's own order stays.
    """
    across = corners[0, -1] - corners[0, 0]
    down = corners[-1, 0] - corners[0, 0]
    if across[0] * down[1] - across[1] * down[0] < 0.0:
        corners = corners[::-1]
    rows, columns = corners.shape[:2]
    if (rows + columns) % 2 and _grey(image, corners, 0, 0) > _grey(image, corners, 0, 1):
        corners = corners[::-1, ::-1]
    return np.ascontiguousarray(corners.reshape(-1, 2))


def _grey(image: Image, corners: Array, row: int, column: int) -> float:
    """Mean grey around the middle of the square after inner corner (row, column)."""
    middle = corners[row : row + 2, column : column + 2].mean(axis=(0, 1))
    x, y = np.clip(np.round(middle).astype(int), 1, np.array(image.shape[::-1]) - 2)
    return float(image[y - 1 : y + 2, x - 1 : x + 2].mean())
