"""Curves over two logarithmic axes as SVG, for commands that draw without the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WIDTH, HEIGHT, MARGIN = 420.0, 300.0, 52.0
COLOURS = ("#0b5394", "#b45f06", "#38761d")


@dataclass(frozen=True, slots=True)
class Panel:
    """One picture.

    Attributes:
        title: above it.
        across: label of the horizontal axis.
        up: label of the vertical axis.
        x: positive, (n,).
        curves: positive, (n, k).
    """

    title: str
    across: str
    up: str
    x: Array
    curves: Array


def log_log_svg(panels: Sequence[Panel]) -> bytes:
    """The panels side by side."""
    whole = WIDTH * len(panels)
    body = "".join(_panel(panel, k * WIDTH) for k, panel in enumerate(panels))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {whole:g} {HEIGHT:g}" '
        f'font-family="sans-serif" font-size="11">\n'
        f'<rect width="100%" height="100%" fill="white"/>\n{body}</svg>\n'
    ).encode()


def _panel(panel: Panel, left: float) -> str:
    x, curves = np.log10(panel.x), np.log10(panel.curves)
    x_range = (np.floor(x.min() + 1e-9), np.ceil(x.max() - 1e-9))
    y_range = (np.floor(curves.min()), np.ceil(curves.max()))
    box = (left + MARGIN, left + WIDTH - 14.0, HEIGHT - MARGIN + 8.0, 28.0)

    def place(value: Array | float, extent: tuple[float, float], low: float, high: float) -> Array:
        share = (np.asarray(value) - extent[0]) / max(extent[1] - extent[0], 1e-9)
        return low + share * (high - low)

    lines = [
        f'<rect x="{box[0]:g}" y="{box[3]:g}" width="{box[1] - box[0]:g}" '
        f'height="{box[2] - box[3]:g}" fill="none" stroke="#888"/>',
        f'<text x="{(box[0] + box[1]) / 2:g}" y="18" text-anchor="middle">'
        f"{escape(panel.title)}</text>",
        f'<text x="{(box[0] + box[1]) / 2:g}" y="{HEIGHT - 8:g}" text-anchor="middle">'
        f"{escape(panel.across)}</text>",
        f'<text x="{left + 12:g}" y="{HEIGHT / 2:g}" text-anchor="middle" '
        f'transform="rotate(-90 {left + 12:g} {HEIGHT / 2:g})">{escape(panel.up)}</text>',
    ]
    for power in np.arange(x_range[0], x_range[1] + 1):
        at = float(place(power, x_range, box[0], box[1]))
        lines.append(f'<path d="M{at:.1f} {box[2]:g}V{box[3]:g}" stroke="#ddd"/>')
        lines.append(_tick(at, box[2] + 14, power, "middle"))
    for power in np.arange(y_range[0], y_range[1] + 1):
        at = float(place(power, y_range, box[2], box[3]))
        lines.append(f'<path d="M{box[0]:g} {at:.1f}H{box[1]:g}" stroke="#ddd"/>')
        lines.append(_tick(box[0] - 4, at + 4, power, "end"))
    across = place(x, x_range, box[0], box[1])
    for k, curve in enumerate(curves.T):
        points = zip(across, place(curve, y_range, box[2], box[3]), strict=True)
        path = " ".join(f"{a:.1f},{b:.1f}" for a, b in points)
        colour = COLOURS[k % len(COLOURS)]
        lines.append(
            f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
        )
    return "\n".join(lines) + "\n"


def _tick(x: float, y: float, power: float, anchor: str) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">10'
        f'<tspan dy="-4" font-size="8">{power:.0f}</tspan></text>'
    )
