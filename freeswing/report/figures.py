"""Figures as inline SVG: one style, deterministic, drawn without a display."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

INK, FAINT = "#1c2733", "#9aa7b3"
MEASURED, BEFORE, AFTER = "#1c2733", "#c8641b", "#1769aa"
SERIES = ("#1769aa", "#c8641b", "#3b8a5a", "#8a4fa3", "#a08a1c", "#5b6b7a")
MAX_POINTS = 1200
_STYLE: Any = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 9.0,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e3e8ec",
    "grid.linewidth": 0.6,
    "text.color": INK,
    "text.parse_math": False,
    "xtick.color": INK,
    "ytick.color": INK,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
}


def figure_style() -> dict[str, Any]:
    """The one style, for figures that are files of their own."""
    return dict(_STYLE)


def figure(
    draw: Callable[[Figure], None], width_in: float, height_in: float, caption: str
) -> Markup:
    """An SVG figure with its caption, which is also its description for screen readers.

    Args:
        draw: fills the empty figure.
        width_in: drawing width in inches; the page scales it to the column.
        height_in: drawing height in inches.
        caption: one sentence that says what is seen.
    """
    with mpl.rc_context({**_STYLE, "svg.hashsalt": caption}):
        sheet = Figure(figsize=(width_in, height_in), layout="constrained")
        draw(sheet)
        buffer = io.StringIO()
        FigureCanvasSVG(sheet).print_svg(buffer, metadata={"Date": None, "Creator": None})
    svg = _unique_ids(_only_svg(buffer.getvalue()), caption)
    return Markup(
        '<figure role="img" aria-label="{0}">{1}<figcaption>{0}</figcaption></figure>'
    ).format(escape(caption), Markup(svg))


def thin(values: np.ndarray, limit: int = MAX_POINTS) -> np.ndarray:
    """Every k-th value, so that a line has no more than `limit` points."""
    step = -(-len(values) // limit) if len(values) else 1
    return values[::step]


def plain_log_axes(axes: Axes) -> None:
    """Decades as plain numbers, few of them."""
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=4))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())


def _only_svg(text: str) -> str:
    """The svg element alone; its size is left to the page, its view box kept."""
    body = text[text.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    head, rest = body.split(">", 1)
    return re.sub(r'\s(width|height)="[^"]*"', "", head) + ">" + rest


def _unique_ids(svg: str, salt: str) -> str:
    """Ids that stay unique when several figures share one page."""
    prefix = f"f{abs(hash_of(salt)):x}-"
    svg = re.sub(r'\bid="', f'id="{prefix}', svg)
    svg = re.sub(r"url\(#", f"url(#{prefix}", svg)
    return re.sub(r'href="#', f'href="#{prefix}', svg)


def hash_of(text: str) -> int:
    """A small number that is the same in every process (unlike `hash`)."""
    from zlib import crc32

    return crc32(text.encode("utf-8"))
