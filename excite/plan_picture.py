"""A picture of planned swings: plan view and side view, as one SVG."""

from __future__ import annotations

from xml.sax.saxutils import escape

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.excite.swing import Bench, Swing

_WIDTH, _GAP, _MARGIN = 460.0, 40.0, 30.0
_MAGNIFIED = 4.0
_COLOURS = ("#1b6ca8", "#c8553d", "#3a7d44", "#8e5ea2", "#b58900", "#268bd2")


def swings_svg(bench: Bench, swings: tuple[Swing, ...]) -> str:
    """The pulleys, each equilibrium and the path of P about it, four times magnified."""
    paths = [bench.course(s.release, bench.duration_s, 1e-6).zetas[:, :3] for s in swings]
    rests = [swing.equilibrium.zeta[:3] for swing in swings]
    paths = [rest + _MAGNIFIED * (path - rest) for rest, path in zip(rests, paths, strict=True)]
    entries = bench.model.robot.entries_m
    everything = np.vstack([entries, *rests])
    low, high = everything.min(axis=0) - 0.15, everything.max(axis=0) + 0.15
    scale = _WIDTH / (high[0] - low[0])
    views = (((0, 1), "from above: x right, y up"), ((0, 2), "from the side: x right, z up"))
    parts, left, tallest = [], _MARGIN, 0.0
    for axes, title in views:
        height = scale * (high[axes[1]] - low[axes[1]])

        def place(points: Array, axes=axes, left=left, height=height) -> Array:
            across = left + scale * (points[..., axes[0]] - low[axes[0]])
            down = _MARGIN + 20 + height - scale * (points[..., axes[1]] - low[axes[1]])
            return np.stack([across, down], axis=-1)

        parts += _view(
            title, left, place(entries), [place(p) for p in paths], place(np.array(rests))
        )
        tallest = max(tallest, height)
        left += _WIDTH + _GAP
    size = f"{left:.0f} {tallest + 2 * _MARGIN + 40:.0f}"
    note = f"paths {_MAGNIFIED:g} times magnified about their equilibria; squares are pulleys"
    parts.append(f'<text x="{_MARGIN}" y="{tallest + _MARGIN + 50:.0f}">{escape(note)}</text>')
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}" '
        'font-family="sans-serif" font-size="12">'
    )
    return "\n".join([head, *parts, "</svg>", ""])


def _view(title: str, left: float, pulleys: Array, paths: list[Array], rests: Array) -> list[str]:
    parts = [f'<text x="{left}" y="{_MARGIN}">{escape(title)}</text>']
    parts += [
        f'<rect x="{x - 4:.1f}" y="{y - 4:.1f}" width="8" height="8" fill="#444"/>'
        for x, y in pulleys
    ]
    for k, path in enumerate(paths):
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in path)
        colour = _COLOURS[k % len(_COLOURS)]
        x, y = rests[k]
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}"/>')
        parts.append(f'<text x="{x + 6:.1f}" y="{y - 6:.1f}">{k + 1}</text>')
    return parts
