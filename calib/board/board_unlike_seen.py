"""The board against what was seen: another layout, another order of counts, its mirrored back."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.board_corners import BoardDetector
from freeswing.calib.board.declared_board import Board
from freeswing.calib.board.planar_pose import flatness_errors
from freeswing.calib.camera.lens_models import Array
from freeswing.cdpr.files.documents import DataError

FLAT = 0.02
"""Corners of the right board lie on a plane to 0.1 % of its size, with a wide lens to 1 %; those of
a wrong layout are off by a square or more."""
_LEAST_VIEWS = 3  # their median is not led by a false one
_MARKER_OFF = 0.01  # of a marker: prints are right to some tenths of a percent


def settled_board(board: Board, pixels: Array) -> tuple[Board, str | None]:
    """The board that the views show, and what to say when it is not the one stated.

    Args:
        board: as session.toml states it.
        pixels: corners of all views, NaN where unseen, (n, n_points, 2).

    Raises:
        DataError: when the counts are stated the wrong way round.
    """
    if not board.has_tags or len(pixels) < _LEAST_VIEWS:
        return board, None
    bent = _bent(board, pixels)
    if not bent > FLAT:
        return board, None
    for other, text in _layouts(board):
        if len(other.points_m) != len(board.points_m) or not _bent(other, pixels) < 0.3 * bent:
            continue
        if _bent(other, pixels) > FLAT:
            continue
        if other.legacy != board.legacy and other.columns == board.columns:
            return other, f"{text}: it is used so"
        raise DataError(
            f"the board's corners lie on no plane ({100 * bent:.0f} % of its size off), but they "
            f"do ({100 * _bent(other, pixels):.1f} %) when {text}: correct session.toml"
        )
    return board, None


def _layouts(board: Board) -> Iterator[tuple[Board, str]]:
    swapped = replace(board, columns=board.rows, rows=board.columns)
    kind = "the new one" if board.legacy else "that of OpenCV before 4.6 (legacy = true)"
    if board.kind == "charuco":
        yield replace(board, legacy=not board.legacy), f"the board's layout is {kind}"
    yield swapped, f"columns and rows are exchanged, {board.rows} x {board.columns}"
    if board.kind == "charuco":
        other = replace(swapped, legacy=not board.legacy)
        text = f"columns and rows are exchanged and the layout is {kind}"
        yield other, text


def _bent(board: Board, pixels: Array) -> float:
    return float(np.nanmedian(flatness_errors(board.points_m[:, :2], pixels)))


def corners_in_a_mirror(board: Board, images: Sequence[NDArray[np.uint8]]) -> int:
    """How many corners of the board images show in a mirror."""
    detector = BoardDetector(board)
    found = [detector.detect(np.ascontiguousarray(image[:, ::-1])) for image in images]
    return sum(corners.count for corners in found if corners is not None)


def marker_warning(board: Board, growth_m: float) -> str | None:
    """Says when a ChArUco board's markers came out in another size than stated."""
    if board.kind != "charuco" or abs(growth_m) < _MARKER_OFF * board.marker_m:
        return None
    true = board.marker_m + growth_m
    return (
        f"the board's markers are {1e3 * true:.2f} mm beside squares of {1e3 * board.square_m:.2f} "
        f"mm, marker_m says {1e3 * board.marker_m:.2f}: taken as measured; check square_m on the "
        "print, all lengths rest on it"
    )
