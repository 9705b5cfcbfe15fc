"""Figures as inline SVG: one style, deterministic, drawn without a display.

A figure is a row of small drawings that wrap, so that a phone shows them below each other at the
size at which they can be read. Colours are names that the page's style gives a value, so that they
turn with its dark mode; no colour stands alone: dashes, marks and hatching say the same.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

INK, FAINT, GRID = "#1c2733", "#9aa7b3", "#e3e8ec"
MEASURED, BEFORE, AFTER = "#1c2733", "#c8641b", "#1769aa"
SERIES = ("#1769aa", "#c8641b", "#3b8a5a", "#8a4fa3", "#a08a1c", "#5b6b7a")
MARKS = ("o", "s", "^", "D", "v", "P")
DASHES = ("-", "--", "-.", ":")
# The page's names of these colours, see templates/page.css.
COLOURS = {INK: "ink", FAINT: "axis", GRID: "grid"} | {
    colour: f"series-{k}" for k, colour in enumerate(SERIES)
}
MAX_POINTS = 700
CELL_IN = 3.4  # width of one drawing; a phone's column shows it at about its own size
_STYLE: Any = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 9.0,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "axes.facecolor": "none",
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "text.color": INK,
    "text.parse_math": False,
    "xtick.color": INK,
    "ytick.color": INK,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
}

Draw = Callable[[Figure], None]


def figure_style() -> Any:
    """The one style, for figures that are files of their own."""
    return dict(_STYLE)


def figure(draw: Draw, width_in: float, height_in: float, caption: str) -> Markup:
    """One drawing with its caption, which is also its description for screen readers.

    Args:
        draw: fills the empty figure.
        width_in: drawing width in inches; the page scales it to the column.
        height_in: drawing height in inches.
        caption: one sentence that says what is seen.
    """
    return figures([draw], height_in, caption, width_in)


def figures(
    draws: Sequence[Draw], height_in: float, caption: str, width_in: float = CELL_IN
) -> Markup:
    """Several drawings side by side, or below each other where the page is narrow."""
    cells = [_svg(draw, width_in, height_in, f"{caption} {k}") for k, draw in enumerate(draws)]
    kind = "one" if len(cells) == 1 else "many"
    return Markup(
        '<figure class="{2}" role="img" aria-label="{0}"><div class="cells">{1}</div>'
        "<figcaption>{0}</figcaption></figure>"
    ).format(escape(caption), Markup("").join(cells), kind)


def key(entries: Sequence[tuple[str, str, str]]) -> Draw:
    """A drawing that explains lines: label, colour and dash (or mark) of each."""

    def draw(sheet: Figure) -> None:
        for label, colour, dash in entries:
            style: dict[str, Any] = (
                {"ls": dash} if dash in DASHES else {"ls": "", "marker": dash, "ms": 5}
            )
            sheet.gca().plot([], [], color=colour, label=label, **style)
        sheet.gca().set_axis_off()
        sheet.legend(loc="center left", ncols=1, fontsize=9)

    return draw


def roomy(sheet: Figure) -> Axes:
    """Axes with fixed margins for two labels: three times quicker than margins that are fitted."""
    sheet.set_layout_engine("none")
    return sheet.add_axes((0.25, 0.26, 0.73, 0.7))


def thin(values: np.ndarray, limit: int = MAX_POINTS) -> np.ndarray:
    """Every k-th value, so that a line has no more than `limit` points."""
    step = -(-len(values) // limit) if len(values) else 1
    return values[::step]


def interval_axes(axes: Axes, label: str) -> None:
    """Axes of intervals one below the other: a few plain numbers along x, nothing along y."""
    axes.set_yticks([])
    axes.margins(y=0.3)
    axes.locator_params(axis="x", nbins=4)
    axes.ticklabel_format(axis="x", useOffset=False)
    axes.set_xlabel(label)
    axes.spines["left"].set_visible(False)


def plain_log_axes(axes: Axes) -> None:
    """Decades as plain numbers, few of them; ticks between them cost more time than all else."""
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=4))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_locator(NullLocator())


def _svg(draw: Draw, width_in: float, height_in: float, salt: str) -> Markup:
    with mpl.rc_context({**_STYLE, "svg.hashsalt": salt}):
        sheet = Figure(figsize=(width_in, height_in), layout="constrained")
        draw(sheet)
        buffer = io.StringIO()
        FigureCanvasSVG(sheet).print_svg(buffer, metadata={"Date": None, "Creator": None})
    svg = _unique_ids(_only_svg(buffer.getvalue()), salt)
    for colour, name in COLOURS.items():
        svg = svg.replace(colour, f"var(--{name})")
    return Markup(svg)


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
