"""Draw a session's calibration board and tags, to be printed at their true size."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from freeswing.commands.arguments import add_session, open_session
from freeswing.console import Console

if TYPE_CHECKING:
    from collections.abc import Iterator

    from freeswing.session import Session
    from vision.patterns import Patch


def add_arguments(parser: ArgumentParser) -> None:
    """The session."""
    add_session(parser)


def run(options: Namespace, console: Console) -> None:
    """One SVG file for the board and for each tag on the platform and on the frame."""
    from cdpr.documents import DataError, replace_file
    from freeswing.printing import sheet_svg

    session = open_session(options)
    written = []
    for name, label, patch in _sheets(session):
        path = session.results / "print" / f"{name}.svg"
        replace_file(path, sheet_svg(patch.cells, patch.size_m, label).encode("utf-8"))
        console.say(str(path))
        written.append(str(path))
    if not written:
        raise DataError(f"{session.path}: names neither a calibration board nor tags to print")
    console.say_json({"format": "freeswing-board/1", "sheets": written})


def _sheets(session: Session) -> Iterator[tuple[str, str, Patch]]:
    import numpy as np

    from freeswing.swings import load_target
    from vision.patterns import tag_patch

    calibration = session.calibration
    if calibration is not None and calibration.board is not None:
        yield "board", f"{calibration.board['kind']} board", _board_patch(calibration.board)
    target = load_target(session)
    tags = [(tag.family, tag.id, tag.size_m) for tag in target.tags] if target else []
    for tag in calibration.base_tags if calibration is not None else ():
        side = float(np.linalg.norm(tag.corners_base_m[1] - tag.corners_base_m[0]))
        tags.append((tag.family, tag.id, side))
    for family, number, side in tags:
        label = f"{family} {number}, black border {1e3 * side:.6g} mm"
        yield f"{family}-{number}", label, tag_patch(family, number, side)


def _board_patch(table) -> Patch:
    from calib.boards import board_from
    from vision.patterns import aprilgrid_patch, charuco_patch, chessboard_patch

    board = board_from(table)
    counts = (board.columns, board.rows)
    if board.kind == "charuco":
        return charuco_patch(counts, board.square_m, board.marker_m, board.dictionary)
    if board.kind == "chessboard":
        return chessboard_patch(counts, board.square_m)
    spacing = board.marker_m / board.square_m
    return aprilgrid_patch(*counts, board.square_m, spacing, board.dictionary)
