"""Finds a calibration board's corners in an image.

Tags of a ChArUco board or an AprilGrid are found by OpenCV and then fitted, pattern against pixels
(`calib.tags.corners`): 0.01 px where the crossings between squares give 0.09 px, pulled by the
markers beside them. Pixel (0, 0) is the centre of the top-left pixel throughout.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.boards import Board
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.tags.corners import TagFit, fit_tag, rimmed_cells
from freeswing.calib.tags.tag_patterns import cut_dictionary

Image = NDArray[np.uint8]

LEAST_CORNERS = 6
_KALIBR_BORDERS = (2, 1)
_WINDOW_MARGIN = 0.3
_WINDOW_MARGIN_PX = 6.0
_LEAST_EXPLAINED = 0.8
_LEAST_STD_PX = 0.003


@dataclass(frozen=True, slots=True)
class BoardCorners:
    """A board's corners in one image.

    Attributes:
        pixels: x, y, NaN where unseen, (n_points, 2).
        covariance_px2: of each group of c corners that were found together (four of a tag, one of
            a chessboard), (n_points / c, 2 c, 2 c); the chessboard's is the identity.
    """

    pixels: Array
    covariance_px2: Array

    @property
    def count(self) -> int:
        """Corners found."""
        return int(np.isfinite(self.pixels[:, 0]).sum())


@dataclass(slots=True)
class BoardDetector:
    """Detector of one board; keeps OpenCV's set-up between images.

    Boards printed white on black are found in the negative: the first image with a board decides.
    """

    board: Board
    is_negative: bool | None = field(default=None, init=False)
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

    @property
    def border_cells(self) -> int:
        """Width of the tags' black border in cells, as last found."""
        return self._tags[0][0] if self._tags else 1

    @property
    def state(self) -> NDArray[np.int64]:
        """What it has learnt of the board: in the negative (-1 unknown), then borders in use."""
        negative = -1 if self.is_negative is None else int(self.is_negative)
        return np.array([negative, *(border for border, _ in self._tags)], dtype=np.int64)

    def knows(self, state: NDArray[np.int64]) -> bool:
        """Whether that is a state of a detector of this board, with no more borders than now."""
        borders = [border for border, _ in self._tags]
        own = state[1:].tolist() if state.ndim == 1 and len(state) else [0]
        known = set(own) <= set(borders) and len(own) == len(set(own))
        return known and bool(own) == bool(borders) and int(state[0]) in (-1, 0, 1)

    def restore(self, state: NDArray[np.int64]) -> None:
        """Take up a state that it `knows`."""
        self.is_negative = None if state[0] < 0 else bool(state[0])
        self._tags = [entry for entry in self._tags if entry[0] in state[1:]]

    def nothing(self) -> BoardCorners:
        """No corner at all."""
        size = 1 if self.board.kind == "chessboard" else 4
        blank = np.full((self._points // size, 2 * size, 2 * size), np.nan)
        return BoardCorners(np.full((self._points, 2), np.nan), blank)

    def detect(self, image: Image) -> BoardCorners | None:
        """The board's corners with their covariance; None when there is no board."""
        if self.board.kind == "chessboard":
            corners = self._find_chessboard(image)
            alike = np.tile(np.eye(2), (self._points, 1, 1))
            return None if corners is None else BoardCorners(corners, alike)
        if self.is_negative is not None:
            return self._detect_tags(255 - image if self.is_negative else image)
        for negative in (False, True):
            found = self._detect_tags(255 - image if negative else image)
            if found is not None:
                self.is_negative = negative
                return found
        return None

    def _detect_tags(self, image: Image) -> BoardCorners | None:
        """Tags of a board that is black on white in the image."""
        best = self.nothing()
        for border, detector in self._tags:
            found = self._tag_corners(image, border, detector)
            if found.count > best.count:
                best = found
            if best.count >= 4 * LEAST_CORNERS:
                self._tags = [(border, detector)]  # the border is printed one way only
                break
        return best if best.count >= LEAST_CORNERS else None

    def _find_chessboard(self, image: Image) -> Array | None:
        size = (self.board.columns, self.board.rows)
        flags = cv2.CALIB_CB_EXHAUSTIVE + cv2.CALIB_CB_ACCURACY
        found, corners = cv2.findChessboardCornersSB(image, size, flags=flags)
        if not found or corners is None:
            return None
        return _oriented(image, np.reshape(corners, (*size[::-1], 2)).astype(float))

    def _tag_corners(
        self, image: Image, border: int, detector: cv2.aruco.ArucoDetector
    ) -> BoardCorners:
        """Fitted corners of every tag that is found."""
        corners = self.nothing()
        quads, ids, _ = detector.detectMarkers(image)
        for quad, tag in zip(quads, [] if ids is None else map(int, np.ravel(ids)), strict=True):
            cells = rimmed_cells(
                self.board.dictionary,
                tag,
                border,
                corner_squares=self.board.kind == "aprilgrid",
            )
            fit = _fitted(image, np.reshape(quad, (4, 2)).astype(float), cells)
            if fit is not None:
                corners.pixels[4 * tag : 4 * tag + 4] = fit.rays
                corners.covariance_px2[tag] = fit.rays_covariance + _LEAST_STD_PX**2 * np.eye(8)
        return corners


def _fitted(image: Image, quad: Array, cells: Array) -> TagFit | None:
    """The tag's pattern fitted around a guess of its corners, in pixels."""
    low, high = quad.min(axis=0), quad.max(axis=0)
    margin = _WINDOW_MARGIN * float((high - low).max()) + _WINDOW_MARGIN_PX
    left, top = np.maximum(np.floor(low - margin), 0).astype(int)
    right, bottom = np.ceil(high + margin).astype(int) + 1
    window = np.ascontiguousarray(image[top:bottom, left:right])
    rows, columns = np.indices(window.shape)
    rays = np.stack([columns + left, rows + top], axis=-1).astype(np.float64)
    fit = fit_tag(window, rays, quad, quad - [left, top], cells)
    return None if fit is None or fit.explained < _LEAST_EXPLAINED else fit


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
