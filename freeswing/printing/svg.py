"""A sheet as SVG: one path, in millimetres."""

from __future__ import annotations

from xml.sax.saxutils import escape

from freeswing.printing.sheet import Sheet


def sheet_svg(sheet: Sheet) -> bytes:
    """The file's bytes."""
    rows, columns = sheet.cells.shape
    width, height, total = sheet.width_mm, sheet.height_mm, sheet.total_mm
    scale = f"scale({width / columns:.9g} {height / rows:.9g})"
    path = "".join(f"M{x} {y}h{w}v{h}h{-w}z" for x, y, w, h in sheet.bars())
    style = f'text-anchor="middle" font-family="sans-serif" font-size="{sheet.text_mm:.4g}"'
    lines = "".join(
        f'<text x="{width / 2:.6g}" y="{place:.6g}" {style}>{escape(line)}</text>\n'
        for place, line in sheet.caption
    )
    text = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.9g}mm" height="{total:.9g}mm" '
        f'viewBox="0 0 {width:.9g} {total:.9g}">\n'
        f'<rect width="100%" height="100%" fill="white"/>\n'
        f'<path transform="{scale}" fill="black" d="{path}"/>\n{lines}</svg>\n'
    )
    return text.encode()
