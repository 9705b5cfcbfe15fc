"""The robot in space: pulleys, cables, platform and the swings' paths, seen from two sides.

Two still views instead of one that turns: they need no script, print, and are read out as text.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from freeswing.cdpr.robot import Array, Robot
from freeswing.cdpr.rotation import matrix_from_angles
from freeswing.report.figures import AFTER, BEFORE, FAINT, INK, Draw, figures, thin
from freeswing.results.identification import SwingPlace
from freeswing.results.motion import RunMotion

ELEVATION_RAD = np.deg2rad(22.0)
AZIMUTHS_RAD = (np.deg2rad(-62.0), np.deg2rad(-28.0))
MOST_PATHS = 6
ENLARGED = (1.0, 2.0, 5.0, 10.0, 20.0)
SEEN_SHARE = 0.2  # of the robot's width: large enough to see a path's shape
PATH_POINTS = 160
PLACE = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class InSpace:
    """What is drawn, base frame.

    Attributes:
        entries_m: pulleys, (n, 3).
        ends_m: attachments as the platform hung, (n, 3).
        point_m: P as it hung, (3,).
        up: against gravity, unit vector, (3,).
        paths: of P by run: whether it was fitted, and places, (n_t, 3).
        enlarged: how many times larger than they are, each about its middle.
    """

    entries_m: Array
    ends_m: Array
    point_m: Array
    up: Array
    paths: tuple[tuple[bool, Array], ...]
    enlarged: float


def in_space(
    robot: Robot | None, swings: Sequence[SwingPlace], motions: Sequence[RunMotion]
) -> Markup:
    """Both views; empty without a robot or a pose in which it hung."""
    hung = next((one.equilibrium for one in swings if one.equilibrium is not None), None)
    if robot is None or hung is None:
        return Markup()
    place = np.array(hung.position_m, dtype=np.float64)
    turn = matrix_from_angles(np.array(hung.angles_rad, dtype=np.float64))
    paths = tuple(_paths(motions))
    enlarged = enlargement([path for _, path in paths], robot.entries_m)
    drawn = InSpace(
        robot.entries_m,
        place + robot.attachments_m @ turn.T,
        place,
        -robot.gravity_m_s2 / np.linalg.norm(robot.gravity_m_s2),
        paths,
        enlarged,
    )
    larger = f", {enlarged:g} times larger than they are" if enlarged > 1.0 else ""
    caption = (
        "The robot in space, from two sides: pulleys (triangles), cables, the platform's "
        f"attachments as it hung in the first run (filled), and the paths of P{larger}: solid "
        "where they were fitted, dashed where they were kept apart. The bar is 0.5 m long."
    )
    return figures([_view(drawn, azimuth) for azimuth in AZIMUTHS_RAD], 3.0, caption)


def enlargement(paths: Sequence[Array], entries_m: Array) -> float:
    """By how much paths are drawn larger so that they can be seen beside the robot."""
    if not paths:
        return 1.0
    size = max(float(np.nanmax(np.nanmax(path, 0) - np.nanmin(path, 0))) for path in paths)
    room = SEEN_SHARE * float(np.ptp(entries_m, axis=0).max())
    fitting = [factor for factor in ENLARGED if factor * size <= room]
    return fitting[-1] if fitting else ENLARGED[0]


def _paths(motions: Sequence[RunMotion]) -> list[tuple[bool, Array]]:
    found = []
    for one in motions[:MOST_PATHS]:
        if not set(PLACE) <= set(one.coordinates):
            continue
        columns = [one.coordinates.index(name) for name in PLACE]
        rows = [[row[k] for k in columns] for row in one.measured]
        found.append((one.role == "identify", thin(np.array(rows, dtype=float), PATH_POINTS)))
    return found


def projected(points: Array, azimuth_rad: float, up: Array) -> Array:
    """Points as seen from far away, to the right and up, in their own unit, (..., 2).

    Args:
        points: base frame, (..., 3).
        azimuth_rad: the viewer's direction about the vertical.
        up: against gravity, unit vector, (3,).

    Source:
        Foley et al. 1996, Computer Graphics, ch. 6: parallel projection.
    """
    side = np.eye(3)[int(np.argmin(np.abs(up)))]
    first = side - (side @ up) * up
    first /= np.linalg.norm(first)
    second = np.cross(up, first)
    right = -np.sin(azimuth_rad) * first + np.cos(azimuth_rad) * second
    towards = np.cos(azimuth_rad) * first + np.sin(azimuth_rad) * second
    above = np.cos(ELEVATION_RAD) * up - np.sin(ELEVATION_RAD) * towards
    return np.asarray(points @ np.stack([right, above], axis=-1), dtype=np.float64)


def _view(drawn: InSpace, azimuth_rad: float) -> Draw:
    def draw(sheet: Figure) -> None:
        sheet.set_layout_engine("none")
        axes = sheet.add_axes((0.02, 0.02, 0.96, 0.96))
        entries, ends, point = (
            projected(part, azimuth_rad, drawn.up)
            for part in (drawn.entries_m, drawn.ends_m, drawn.point_m)
        )
        for is_fitted, path in drawn.paths:
            middle = np.nanmean(path, axis=0)
            shown = middle + drawn.enlarged * (path - middle)
            seen = projected(shown, azimuth_rad, drawn.up)
            colour, dash = (AFTER, "-") if is_fitted else (BEFORE, "--")
            axes.plot(*seen.T, color=colour, ls=dash, lw=0.8)
        for entry, end in zip(entries, ends, strict=True):
            axes.plot(*np.stack([entry, end]).T, color=FAINT, lw=1.0)
        axes.fill(*ends[_around(ends)].T, facecolor=FAINT, alpha=0.35, edgecolor=INK, lw=1.0)
        axes.plot(*entries.T, "^", color=INK, ms=5)
        axes.plot(*point, "o", color=INK, ms=5, fillstyle="none")
        everything = np.concatenate([entries, ends])
        left, low = everything.min(axis=0)
        axes.plot([left, left + 0.5], [low - 0.08] * 2, color=INK, lw=2.0)
        axes.annotate(
            "0.5 m",
            (left + 0.25, low - 0.08),
            xytext=(0, -11),
            textcoords="offset points",
            ha="center",
            fontsize=8,
        )
        axes.margins(0.08, 0.12)
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_axis_off()

    return draw


def _around(points: Array) -> Array:
    """Order in which points are met around their middle, (n,)."""
    out = points - points.mean(axis=0)
    return np.argsort(np.arctan2(out[:, 1], out[:, 0]))
