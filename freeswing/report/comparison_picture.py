"""Results side by side as one picture: each parameter's intervals, a mark and a row a side."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from freeswing.cdpr.files.documents import InputError
from freeswing.report.figures import INK, MARKS, SERIES, figure_style, interval_axes
from freeswing.report.words import HALF_WIDTH_95, plain, unit_of
from freeswing.results.comparison import NOTABLE_Z, Comparison, Row

ACROSS = 3
SUFFIXES = (".svg", ".png", ".pdf")


def comparison_sheet(found: Comparison) -> Figure:
    """Every parameter with its 95 % interval on each side; what differs notably says its z."""
    with mpl.rc_context(figure_style()):
        down = -(-len(found.rows) // ACROSS)
        height = 0.8 + down * (0.75 + 0.22 * len(found.sides))
        sheet = Figure(figsize=(9.5, height), layout="constrained")
        for k, row in enumerate(found.rows):
            _draw(sheet.add_subplot(down, ACROSS, k + 1), row)
        names = [f"{side.name} ({side.source})" for side in found.sides]
        marks = [
            Line2D([], [], color=_colour(k), marker=_mark(k), ls="", label=name)
            for k, name in enumerate(names)
        ]
        sheet.legend(handles=marks, loc="outside lower left", fontsize=8)
    return sheet


def write_picture(path: Path, found: Comparison) -> None:
    """The picture as a file, by its suffix.

    Raises:
        InputError: another suffix than .svg, .png or .pdf.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"--picture {path}: {path.suffix!r} is not one of {', '.join(SUFFIXES)}")
    path.parent.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context({**figure_style(), "savefig.facecolor": "white"}):
        told = {"Date": None} if path.suffix.lower() == ".svg" else {}
        comparison_sheet(found).savefig(path, dpi=200, metadata=told)


def _draw(axes: Axes, row: Row) -> None:
    stem, scale, unit = unit_of(row.name)
    for k, (value, std) in enumerate(zip(row.values, row.stds, strict=True)):
        if value is not None:
            half = scale * HALF_WIDTH_95 * (std or 0.0)
            axes.errorbar(
                scale * value, -k, xerr=half, fmt=_mark(k), ms=5, capsize=3, color=_colour(k)
            )
    worst = max((abs(z) for z in row.z if z is not None), default=0.0)
    if worst > NOTABLE_Z:
        axes.set_title(f"z = {worst:.1f}", fontsize=8, loc="right", color=INK)
    interval_axes(axes, f"{plain(stem)} ({unit})")


def _mark(k: int) -> str:
    return MARKS[k % len(MARKS)]


def _colour(k: int) -> str:
    return SERIES[k % len(SERIES)]
