"""Sheets on pages of paper, each with a test ruler, as one PDF of their true size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np

from freeswing.printing.pdf import MM_AN_INCH, POINTS_A_MM, corners_mm
from freeswing.printing.sheet import Sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PAPERS_MM = {"a4": (210.0, 297.0), "letter": (215.9, 279.4), "a3": (297.0, 420.0)}
RULER_MM = 100.0
EDGE_MM = 5.0  # most printers leave 4.2 mm white
FOOT_MM = 16.0  # the ruler and what is written beside it


@dataclass(frozen=True, slots=True)
class Placed:
    """A sheet on a page; left and top in millimetres within the print."""

    sheet: Sheet
    left_mm: float
    top_mm: float


@dataclass(frozen=True, slots=True)
class Page:
    """What one page holds.

    Attributes:
        sheets: side by side, in one print that is centred on the page.
        label: what it is, written beside the ruler.
        cross_mm: where a thin cross is drawn within the print, from its left and top; None: none.
    """

    sheets: tuple[Placed, ...]
    label: str
    cross_mm: tuple[float, float] | None = None

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of the print."""
        return (
            max(one.left_mm + one.sheet.width_mm for one in self.sheets),
            max(one.top_mm + one.sheet.height_mm for one in self.sheets),
        )


def page_room_mm(paper: str) -> tuple[float, float]:
    """What an upright page takes, width and height."""
    width, height = PAPERS_MM[paper]
    return width - 2.0 * EDGE_MM, height - 2.0 * EDGE_MM - FOOT_MM


def label_of(squares: tuple[int, int], square_m: float, dictionary: str) -> str:
    """What a ChArUco board is, for its page."""
    return (
        f"board: charuco {dictionary}, {squares[0]} x {squares[1]}, squares {1e3 * square_m:g} mm"
    )


def pages_pdf(pages: Sequence[Page], paper: str) -> bytes:
    """One PDF; each page upright or across, as its print fits.

    Raises:
        ValueError: a print that fits the paper neither way, with both sizes.
    """
    from matplotlib.backends.backend_pdf import FigureCanvasPdf, PdfPages
    from matplotlib.figure import Figure

    file = BytesIO()
    told = {"CreationDate": None, "Title": "freeswing: print at 100 %"}
    with PdfPages(file, metadata=told) as book:
        for page in pages:
            width, height = _turned(page, paper)
            figure = Figure(figsize=(width / MM_AN_INCH, height / MM_AN_INCH))
            FigureCanvasPdf(figure)
            axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, width), ylim=(height, 0.0))
            axes.set_axis_off()
            _draw(axes, page, width, height)
            book.savefig(figure)
    return file.getvalue()


def _turned(page: Page, paper: str) -> tuple[float, float]:
    """Width and height of the page as it is used."""
    wide, high = page.size_mm
    width, height = PAPERS_MM[paper]
    for across, up in ((width, height), (height, width)):
        if wide <= across - 2.0 * EDGE_MM and high <= up - 2.0 * EDGE_MM - FOOT_MM:
            return across, up
    raise ValueError(
        f"{page.label}: {wide:.0f} x {high:.0f} mm does not fit {paper} ({width:.0f} x "
        f"{height:.0f} mm, {EDGE_MM:g} mm of edge, {FOOT_MM:g} mm for the ruler); take larger paper"
    )


def _draw(axes: Axes, page: Page, width: float, height: float) -> None:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    wide, high = page.size_mm
    left, top = (width - wide) / 2.0, (height - FOOT_MM - high) / 2.0
    for one in page.sheets:
        shift = np.array([left + one.left_mm, top + one.top_mm])
        outlines = [Path(corners + shift, closed=True) for corners in corners_mm(one.sheet)]
        path = Path.make_compound_path(*outlines)
        axes.add_patch(PathPatch(path, facecolor="black", linewidth=0.0))
    if page.cross_mm is not None:
        x, y = left + page.cross_mm[0], top + page.cross_mm[1]
        axes.plot([x - 4.0, x + 4.0], [y, y], color="black", lw=0.4)
        axes.plot([x, x], [y - 4.0, y + 4.0], color="black", lw=0.4)
    _ruler(axes, page.label, (width - RULER_MM) / 2.0, height - EDGE_MM - FOOT_MM + 6.0)


def _ruler(axes: Axes, label: str, left: float, top: float) -> None:
    """A hundred millimetres, a tick each, taller at 5 and 10; what is written stands below."""
    for k in range(int(RULER_MM) + 1):
        tall = 4.0 if k % 10 == 0 else 3.0 if k % 5 == 0 else 2.0
        axes.plot([left + k] * 2, [top, top - tall], color="black", lw=0.25, solid_capstyle="butt")
    axes.plot([left, left + RULER_MM], [top, top], color="black", lw=0.25, solid_capstyle="butt")
    style = {"ha": "center", "va": "baseline", "fontsize": 2.6 * POINTS_A_MM}
    told = f"this ruler must be {RULER_MM:.1f} mm long: print at 100 %, no fit to page"
    middle = left + RULER_MM / 2.0
    axes.text(middle, top + 3.8, told, **style)
    axes.text(middle, top + 7.6, label, **style)
