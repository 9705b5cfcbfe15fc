"""A sheet as a vector PDF whose page has its size."""

from __future__ import annotations

from io import BytesIO

import numpy as np

from freeswing.printing.sheet import Sheet

MM_AN_INCH = 25.4
POINTS_A_MM = 72.0 / MM_AN_INCH


def sheet_pdf(sheet: Sheet) -> bytes:
    """The file's bytes; they do not depend on the clock."""
    from matplotlib.backends.backend_pdf import FigureCanvasPdf
    from matplotlib.figure import Figure
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    width, total = sheet.width_mm, sheet.total_mm
    figure = Figure(figsize=(width / MM_AN_INCH, total / MM_AN_INCH))
    canvas = FigureCanvasPdf(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, width), ylim=(total, 0.0))
    axes.set_axis_off()
    path = Path.make_compound_path(*(Path(corners, closed=True) for corners in corners_mm(sheet)))
    axes.add_patch(PathPatch(path, facecolor="black", linewidth=0.0))
    style = {"ha": "center", "va": "baseline", "fontsize": sheet.text_mm * POINTS_A_MM}
    for place, line in sheet.caption:
        axes.text(width / 2, place, line, parse_math=False, **style)
    file = BytesIO()
    canvas.print_figure(file, metadata={"CreationDate": None, "Title": sheet.label})
    return file.getvalue()


def corners_mm(sheet: Sheet) -> list[np.ndarray]:
    """Closed outlines of the black rectangles, y downwards, (5, 2) each."""
    rows, columns = sheet.cells.shape
    cell = np.array([sheet.width_mm / columns, sheet.height_mm / rows])
    outline = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]])
    return [cell * (np.array([x, y]) + outline * [w, h]) for x, y, w, h in sheet.bars()]
