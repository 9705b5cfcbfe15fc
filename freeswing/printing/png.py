"""A sheet as a black and white PNG: whole pixels to a cell, its resolution in the file."""

from __future__ import annotations

from io import BytesIO

import numpy as np

from freeswing.cdpr.files.documents import DataError
from freeswing.printing.sheet import Sheet

MM_AN_INCH = 25.4
MOST_PIXELS = 2e8


def sheet_png(sheet: Sheet, dpi: float) -> bytes:
    """The file's bytes, at the resolution nearest to `dpi` that cuts no cell.

    What it is, by then a broken number of dots per inch, stands in the file (pHYs), so that it
    prints at its true size to a few millionths.

    Raises:
        DataError: where even one pixel a cell is too many.
    """
    from PIL import Image, ImageDraw, ImageFont

    rows, columns = sheet.cells.shape
    cell_mm = sheet.width_mm / columns
    pixels = max(1, round(dpi * cell_mm / MM_AN_INCH))
    while pixels > 1 and rows * columns * pixels**2 > MOST_PIXELS:
        pixels -= 1
    if rows * columns > MOST_PIXELS:
        raise DataError(
            f"{sheet.label}: {columns} x {rows} cells, more pixels than {MOST_PIXELS:.0e}: "
            "use --format pdf"
        )
    pixels_a_mm = pixels / cell_mm
    size = (columns * pixels, round(sheet.total_mm * pixels_a_mm))
    image = Image.new("1", size, 1)
    print_of_cells = np.kron(sheet.cells >= 0.5, np.ones((pixels, pixels), dtype=bool))
    image.paste(Image.fromarray(print_of_cells), (0, 0))
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(sheet.text_mm * pixels_a_mm)
    for place, line in sheet.caption:
        draw.text((size[0] / 2, place * pixels_a_mm), line, fill=0, font=font, anchor="ms")
    file = BytesIO()
    image.save(file, "PNG", dpi=(MM_AN_INCH * pixels_a_mm,) * 2)
    return file.getvalue()
