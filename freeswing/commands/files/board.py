"""Draw a session's calibration board and tags, to be printed at their true size."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from freeswing.commands.arguments import add_session, finite, open_session
from freeswing.console import Console

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from freeswing.printing.sheet import Sheet
    from freeswing.session.session_file import Session
    from freeswing.vision.render.patterns import Patch


FORMATS = ("pdf", "svg", "png")
PAPERS = ("a4", "letter", "a3")
MOST_DPI = 4800.0


def add_arguments(parser: ArgumentParser) -> None:
    """The session, the kinds of file and their resolution."""
    add_session(parser)
    parser.add_argument(
        "--format",
        choices=FORMATS,
        action="append",
        dest="formats",
        help="default pdf; may be repeated",
    )
    parser.add_argument(
        "--paper", choices=PAPERS, help="also all on pages of paper, a test ruler on each"
    )
    parser.add_argument(
        "--dpi", type=finite, default=600.0, help="dots per inch of png, default 600"
    )


def run(options: Namespace, console: Console) -> None:
    """A file for the board and for each tag on the platform and on the frame."""
    from freeswing.cdpr.files.documents import DataError, InputError, replace_file

    if not 10.0 <= options.dpi <= MOST_DPI:
        raise InputError(f"--dpi {options.dpi:g} must lie in 10 to {MOST_DPI:g}")
    session = open_session(options)
    written = []
    for name, sheet in _sheets(session):
        for kind in dict.fromkeys(options.formats or FORMATS[:1]):
            path = session.results / "print" / f"{name}.{kind}"
            replace_file(path, _bytes(sheet, kind, options.dpi))
            console.say(f"{path}: {sheet.width_mm:.6g} mm wide")
            written.append(str(path))
    if options.paper:
        path = session.results / "print" / f"{options.paper}.pdf"
        replace_file(path, _pages(session, options.paper))
        console.say(f"{path}: all of them, a test ruler on each page")
        written.append(str(path))
    if not written:
        raise DataError(f"{session.path}: names neither a calibration board nor tags to print")
    console.say("print at 100 % (no fit to page), then measure the width with a ruler")
    console.say_json({"format": "freeswing-board/1", "sheets": written})


def _pages(session: Session, paper: str) -> bytes:
    """All sheets on pages of paper.

    Raises:
        InputError: where one does not fit.
    """
    from freeswing.cdpr.files.documents import InputError
    from freeswing.printing.pages import Page, Placed, pages_pdf

    pages = [Page((Placed(sheet, 0.0, 0.0),), sheet.label) for _, sheet in _sheets(session)]
    try:
        return pages_pdf(pages, paper)
    except ValueError as failure:
        raise InputError(f"--paper: {failure}") from failure


def _bytes(sheet: Sheet, kind: str, dpi: float) -> bytes:
    if kind == "pdf":
        from freeswing.printing.pdf import sheet_pdf

        return sheet_pdf(sheet)
    if kind == "png":
        from freeswing.printing.png import sheet_png

        return sheet_png(sheet, dpi)
    from freeswing.printing.svg import sheet_svg

    return sheet_svg(sheet)


def _sheets(session: Session) -> Iterator[tuple[str, Sheet]]:
    import numpy as np

    from freeswing.printing.sheet import Sheet
    from freeswing.session.load_swings import load_target
    from freeswing.vision.render.patterns import tag_patch

    calibration = session.calibration
    if calibration is not None and calibration.board is not None:
        patch = _board_patch(calibration.board)
        yield "board", Sheet(patch.cells, patch.size_m, _board_label(calibration.board))
    target = load_target(session)
    tags = [(tag.family, tag.id, tag.size_m) for tag in target.tags] if target else []
    for tag in calibration.base_tags if calibration is not None else ():
        side = float(np.linalg.norm(tag.corners_base_m[1] - tag.corners_base_m[0]))
        tags.append((tag.family, tag.id, side))
    for family, number, side in tags:
        label = f"{family} {number}, black border {1e3 * side:.6g} mm"
        patch = tag_patch(family, number, side)
        yield f"{family}-{number}", Sheet(patch.cells, patch.size_m, label)


def _board_label(table: Mapping[str, object]) -> str:
    from freeswing.calib.board.declared_board import CIRCLES, board_from

    board = board_from(table)
    counts = f"{board.columns} x {board.rows}"
    side_mm = 1e3 * board.square_m
    if board.kind == "charuco":
        layout = ", layout of OpenCV before 4.6" if board.legacy else ""
        return f"charuco {board.dictionary}, {counts} squares of {side_mm:.6g} mm{layout}"
    if board.kind == "chessboard":
        return f"chessboard, {counts} inner corners, squares of {side_mm:.6g} mm"
    if board.kind in CIRCLES:
        across_mm = 1e3 * board.marker_m
        return f"{board.kind}, {counts} of {across_mm:.6g} mm, {side_mm:.6g} mm apart"
    return f"aprilgrid {board.dictionary}, {counts} tags of {side_mm:.6g} mm"


def _board_patch(table: Mapping[str, object]) -> Patch:
    from freeswing.calib.board.declared_board import CIRCLES, board_from
    from freeswing.vision.render.patterns import (
        aprilgrid_patch,
        charuco_patch,
        chessboard_patch,
        circles_patch,
    )

    board = board_from(table)
    counts = (board.columns, board.rows)
    if board.kind == "charuco":
        return charuco_patch(
            counts, board.square_m, board.marker_m, board.dictionary, legacy=board.legacy
        )
    if board.kind == "chessboard":
        return chessboard_patch(counts, board.square_m)
    if board.kind in CIRCLES:
        return circles_patch(board.points_m[:, :2], board.marker_m)
    spacing = board.marker_m / board.square_m
    return aprilgrid_patch(*counts, board.square_m, spacing, board.dictionary)
