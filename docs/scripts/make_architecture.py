"""Draws the way of the data: `make_architecture.py` writes docs/pictures/architecture.svg."""

from __future__ import annotations

from pathlib import Path

BOXES = {  # name: (x, y, width, colour, lines)
    "recordings": (20, 30, 200, "#e8eef7", ("recordings", "videos, images, .trc .c3d .csv")),
    "calib": (20, 140, 200, "#dbe8d8", ("calib/", "board views to cameras,", "with covariance")),
    "vision": (270, 140, 200, "#f7e6d4", ("vision/", "frames to poses,", "with covariance")),
    "trajectory": (
        520,
        140,
        200,
        "#ffffff",
        ("Trajectory", "(cdpr/measured) poses or", "coordinates over time"),
    ),
    "ident": (520, 270, 200, "#f7e6d4", ("ident/", "signals, FIDIM,", "likelihood, diagnosis")),
    "results": (520, 400, 200, "#e8eef7", ("results/*.json", "typed, with provenance")),
    "report": (270, 400, 200, "#e6def2", ("freeswing/report", "one page for people")),
    "cdpr": (
        20,
        270,
        450,
        "#dbe8d8",
        (
            "cdpr/",
            "the robot on paper: geometry, effects, dynamics, statics, simulation",
            "stated once as expressions; all derivatives follow",
        ),
    ),
    "others": (
        20,
        400,
        200,
        "#f7e6d4",
        ("homing/ excite/ servo/", "start pose, what to record,", "the driven robot"),
    ),
}
ARROWS = (
    ("recordings", "calib"), ("recordings", "vision"), ("calib", "vision"),
    ("vision", "trajectory"), ("recordings", "trajectory"), ("trajectory", "ident"),
    ("cdpr", "ident"), ("ident", "results"),
    ("results", "report"), ("cdpr", "others"),
)  # fmt: skip
HEIGHT = 80


def ends(one: str, other: str) -> tuple[float, float, float, float]:
    """From the side of a box that faces the other, to that other's."""
    (x1, y1, w1, *_), (x2, y2, w2, *_) = BOXES[one], BOXES[other]
    if y1 == y2:
        right = x2 > x1
        return (
            x1 + (w1 if right else 0),
            y1 + HEIGHT / 2,
            x2 + (0 if right else w2),
            y2 + HEIGHT / 2,
        )
    if one == "cdpr" and other == "ident":
        return x1 + w1, y1 + HEIGHT / 2, x2, y2 + HEIGHT / 2
    middle = x1 + w1 / 2 if abs(x1 - x2) < 1 else x1 + w1
    start = (middle, y1 + HEIGHT) if abs(x1 - x2) < 1 else (middle, y1 + HEIGHT / 2)
    if one == "cdpr":
        return x2 + w2 / 2, y1 + HEIGHT, x2 + w2 / 2, y2
    return (*start, x2 + w2 / 2, y2)


def drawn() -> str:
    """The picture."""
    parts = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 740 500" font-family="sans-serif" '
        'font-size="13"><title>The way of the data</title><defs><marker id="tip" markerWidth="8" '
        'markerHeight="8" refX="7" refY="4" orient="auto"><path d="M0,0 L8,4 L0,8 z" fill="#444"/>'
        '</marker></defs><rect width="740" height="500" fill="#fff"/>'
    ]
    for one, other in ARROWS:
        x1, y1, x2, y2 = ends(one, other)
        parts.append(
            f'<line x1="{x1:g}" y1="{y1:g}" x2="{x2:g}" y2="{y2:g}" stroke="#444" '
            'marker-end="url(#tip)"/>'
        )
    for x, y, width, colour, lines in BOXES.values():
        parts.append(
            f'<rect x="{x}" y="{y}" width="{width}" height="{HEIGHT}" rx="6" fill="{colour}" '
            'stroke="#444"/>'
        )
        for k, line in enumerate(lines):
            weight = ' font-weight="bold"' if k == 0 else ""
            parts.append(f'<text x="{x + 12}" y="{y + 24 + 19 * k}"{weight}>{line}</text>')
    return "\n".join([*parts, "</svg>", ""])


if __name__ == "__main__":
    picture = Path(__file__).parents[1] / "pictures" / "architecture.svg"
    picture.write_text(drawn(), encoding="utf-8")
