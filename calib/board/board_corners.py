"""Finds a calibration board's corners in an image.

Tags of a ChArUco board or an AprilGrid are found by OpenCV and then fitted, pattern against pixels
(`calib.tags.corners`): 0.01 px where the crossings between squares give 0.09 px, pulled by the
markers beside them. Circles: `calib.board.circle_grid_corners`. Pixel (0, 0) is the centre of the
top-left pixel throughout.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.chessboard_corners import ChessboardFinder
from freeswing.calib.board.circle_grid_corners import find_circles
from freeswing.calib.board.declared_board import CIRCLES, Board
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.tags.corners import TagFit, fit_tag, rimmed_cells
from freeswing.calib.tags.tag_patterns import cut_dictionary

Image = NDArray[np.uint8]

LEAST_CORNERS = 6  # four of a tag tell a pose that noise turns over; two more settle it
_KALIBR_BORDERS = (2, 1)
_WINDOW_MARGIN = 0.3
_WINDOW_MARGIN_PX = 6.0
_LEAST_EXPLAINED = 0.8  # of the grey values' variance: below, it is a likeness of the tag
LEAST_STD_PX = 0.003  # what print and lens leave: no fit is better than that


@dataclass(frozen=True, slots=True)
class BoardCorners:
    """A board's corners in one image.

    Attributes:
        pixels: x, y, NaN where unseen, (n_points, 2).
        covariance_px2: of each group of c corners that were found together (four of a tag, one of
            a chessboard or of circles), (n_points / c, 2 c, 2 c); theirs is the identity.
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
    _squares: ChessboardFinder = field(init=False, repr=False)
    _tags: list[tuple[int, cv2.aruco.ArucoDetector]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._points = len(self.board.points_m)
        self._squares = ChessboardFinder(self.board.columns, self.board.rows)
        self._tags = []
        if self.board.has_tags:
            borders = (1,) if self.board.kind == "charuco" else _KALIBR_BORDERS
            ids = tuple(range(self.board.n_tags))
            cut = cut_dictionary(self.board.dictionary, ids)
            self._tags = [(border, tag_detector(cut, border)) for border in borders]

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
        size = 4 if self.board.has_tags else 1
        blank = np.full((self._points // size, 2 * size, 2 * size), np.nan)
        return BoardCorners(np.full((self._points, 2), np.nan), blank)

    def detect(self, image: Image) -> BoardCorners | None:
        """The board's corners with their covariance; None when there is no board."""
        if self.board.kind == "chessboard":
            return self._alike(self._squares.find(image))
        look = self._detect_circles if self.board.kind in CIRCLES else self._detect_tags
        if self.is_negative is not None:
            return look(255 - image if self.is_negative else image)
        for negative in (False, True):
            found = look(255 - image if negative else image)
            if found is not None:
                self.is_negative = negative
                return found
        return None

    @property
    def other_board(self) -> str | None:
        """What images show in place of the board, in words, where that is known."""
        return self._squares.other_counts if self.board.kind == "chessboard" else None

    def _alike(self, corners: Array | None) -> BoardCorners | None:
        """Corners of which none is known better than another."""
        alike = np.tile(np.eye(2), (self._points, 1, 1))
        return None if corners is None else BoardCorners(corners, alike)

    def _detect_circles(self, image: Image) -> BoardCorners | None:
        counts, plane = (self.board.columns, self.board.rows), self.board.points_m[:, :2]
        skewed = self.board.kind == "asymmetric_circles"
        return self._alike(find_circles(image, counts, plane, asymmetric=skewed))

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
            fit = fitted_corners(image, np.reshape(quad, (4, 2)).astype(float), cells)
            if fit is not None:
                corners.pixels[4 * tag : 4 * tag + 4] = fit.rays
                corners.covariance_px2[tag] = fit.rays_covariance + LEAST_STD_PX**2 * np.eye(8)
        return corners


def fitted_corners(image: Image, quad: Array, cells: Array) -> TagFit | None:
    """The tag's pattern fitted around a guess of its corners, in pixels."""
    low, high = quad.min(axis=0), quad.max(axis=0)
    margin = _WINDOW_MARGIN * float((high - low).max()) + _WINDOW_MARGIN_PX
    left, top = np.maximum(np.floor(low - margin), 0).astype(int)
    right, bottom = np.ceil(high + margin).astype(int) + 1
    window = np.ascontiguousarray(image[top:bottom, left:right])
    rows, columns = np.indices(window.shape)
    rays = np.stack([columns + left, rows + top], axis=-1).astype(np.float32)
    fit = fit_tag(window, rays, quad, quad - [left, top], cells)
    return None if fit is None or fit.explained < _LEAST_EXPLAINED else fit


def tag_detector(cut: cv2.aruco.Dictionary, border_bits: int) -> cv2.aruco.ArucoDetector:
    """OpenCV's detector of the tags of a dictionary with so wide a border."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.markerBorderBits = border_bits
    parameters.minMarkerPerimeterRate = 0.01
    return cv2.aruco.ArucoDetector(cut, parameters)
