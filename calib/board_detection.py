"""Finds a calibration board's corners in an image.

Tags of a ChArUco board or an AprilGrid are found by OpenCV and then fitted, pattern against pixels
(`calib.corners`): 0.01 px where the crossings between squares give 0.09 px, pulled by the markers
beside them. Pixel (0, 0) is the centre of the top-left pixel throughout.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from calib.boards import Board
from calib.camera_models import Array
from calib.corners import fit_tag, rimmed_cells
from calib.tag_patterns import cut_dictionary

Image = NDArray[np.uint8]

LEAST_CORNERS = 6
_KALIBR_BORDERS = (2, 1)
_WINDOW_MARGIN = 0.3
_WINDOW_MARGIN_PX = 6.0
_LEAST_EXPLAINED = 0.8
_LEAST_STD_PX = 0.003


@dataclass(slots=True)
class BoardDetector:
    """Detector of one board; keeps OpenCV's set-up between images."""

    board: Board
    _points: int = field(init=False, repr=False)
    _tags: list[tuple[int, cv2.aruco.ArucoDetector]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._points = len(self.board.points_m)
        self._tags = []
        if self.board.kind != "chessboard":
            borders = (1,) if self.board.kind == "charuco" else _KALIBR_BORDERS
            ids = tuple(range(self.board.n_tags))
            cut = cut_dictionary(self.board.dictionary, ids)
            self._tags = [(border, _tag_detector(cut, border)) for border in borders]

    def detect(self, image: Image) -> Array | None:
        """Corners x, y in pixels and their standard deviation, (n_points, 3), NaN where unseen.

        None when there is no board.
        """
        if self.board.kind == "chessboard":
            corners = self._find_chessboard(image)
            return None if corners is None else np.column_stack([corners, np.ones(len(corners))])
        best: Array | None = None
        for border, detector in self._tags:
            found = self._tag_corners(image, border, detector)
            if best is None or _count(found) > _count(best):
                best = found
            if _count(best) >= 4 * LEAST_CORNERS:
                self._tags = [(border, detector)]  # the border is printed one way only
                break
        return best if best is not None and _count(best) >= LEAST_CORNERS else None

    def _find_chessboard(self, image: Image) -> Array | None:
        size = (self.board.columns, self.board.rows)
        flags = cv2.CALIB_CB_EXHAUSTIVE + cv2.CALIB_CB_ACCURACY
        found, corners = cv2.findChessboardCornersSB(image, size, flags=flags)
        if not found or corners is None:
            return None
        return _oriented(image, np.reshape(corners, (*size[::-1], 2)).astype(float))

    def _tag_corners(self, image: Image, border: int, detector: cv2.aruco.ArucoDetector) -> Array:
        """Fitted corners of every tag that is found, and their noise, (n_points, 3)."""
        corners = np.full((self._points, 3), np.nan)
        quads, ids, _ = detector.detectMarkers(image)
        for quad, tag in zip(quads, [] if ids is None else np.ravel(ids).tolist(), strict=True):
            cells = rimmed_cells(
                self.board.dictionary,
                int(tag),
                border,
                corner_squares=self.board.kind == "aprilgrid",
            )
            fitted = _fitted(image, np.reshape(quad, (4, 2)).astype(float), cells)
            if fitted is not None:
                corners[4 * tag : 4 * tag + 4] = fitted
        return corners


def _fitted(image: Image, quad: Array, cells: Array) -> Array | None:
    """Corners TL TR BR BL of a tag's pattern fitted around a guess, and their noise, (4, 3)."""
    low, high = quad.min(axis=0), quad.max(axis=0)
    margin = _WINDOW_MARGIN * float((high - low).max()) + _WINDOW_MARGIN_PX
    left, top = np.maximum(np.floor(low - margin), 0).astype(int)
    right, bottom = np.ceil(high + margin).astype(int) + 1
    window = np.ascontiguousarray(image[top:bottom, left:right])
    rows, columns = np.indices(window.shape)
    rays = np.stack([columns + left, rows + top], axis=-1).astype(np.float64)
    fit = fit_tag(window, rays, quad, quad - [left, top], cells)
    if fit is None or fit.explained < _LEAST_EXPLAINED:
        return None
    variance = np.diag(fit.rays_covariance).reshape(4, 2).mean(axis=1)
    return np.column_stack([fit.rays, np.hypot(np.sqrt(variance), _LEAST_STD_PX)])


def _count(corners: Array) -> int:
    return int(np.isfinite(corners[:, 0]).sum())


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
