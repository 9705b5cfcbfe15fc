"""Panel: where the swings were. Equilibria, modes and how well the set is conditioned."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from freeswing.cdpr.robot import Array
from freeswing.report.figures import AFTER, BEFORE, INK, Draw, figures
from freeswing.report.material import Material
from freeswing.report.words import number
from freeswing.results.codec import Numbers
from freeswing.results.identification import SwingPlace


class Swings:
    """The part of the workspace that the data have seen."""

    name = "swings"
    title = "Where the swings were"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Equilibria from above, modes and conditioning by run."""
        identification = material.identification
        if identification is None or not identification.swings:
            return None
        costs = {name: number(estimate.cost_C) for name, estimate in material.estimates.items()}
        return {
            "rows": [_row(entry) for entry in identification.swings],
            "chart": _chart(identification.swings, identification.entries_m),
            "costs": {name: cost for name, cost in costs.items() if cost != "–"},
        }


def _row(entry: SwingPlace) -> dict[str, str]:
    place = entry.equilibrium
    return {
        "run": entry.run,
        "role": entry.role,
        "equilibrium x, y, z (m)": _listed(place and place.position_m, 4),
        "φ, θ, χ (rad)": _listed(place and place.angles_rad, 3),
        "modes (Hz)": _listed(entry.frequencies_hz, 4),
        "pose over free coordinates": number(entry.conditioning),
    }


def _listed(values: Numbers | None, digits: int) -> str:
    return "  ".join(number(value, digits) for value in values or ())


def _chart(swings: tuple[SwingPlace, ...], entries: tuple[Numbers, ...]) -> object:
    places = [(one.role, one.equilibrium.position_m) for one in swings if one.equilibrium]
    if not places:
        return ""
    views = ((0, 1, "from above"), (0, 2, "from the side"))
    caption = (
        "Equilibria of the runs (fitted: blue dots, held out: orange squares) among the pulleys "
        "(triangles)."
    )
    return figures([_view(places, entries, *view) for view in views], 2.8, caption)


def _column(points: Sequence[Numbers], k: int) -> Array:
    """One coordinate of points, NaN where it is not known."""
    return np.array([point[k] for point in points], dtype=float)


def _view(places: list, entries: tuple[Numbers, ...], first: int, second: int, title: str) -> Draw:
    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        for role, colour, mark in (("identify", AFTER, "o"), ("validate", BEFORE, "s")):
            points = [place for found, place in places if found == role]
            across, up = (_column(points, k) for k in (first, second))
            axes.plot(across, up, mark, ms=4, color=colour)
        across, up = (_column(entries, k) for k in (first, second))
        axes.plot(across, up, "^", color=INK, ms=5)
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_xlabel("x (m)")
        axes.set_ylabel(f"{'xyz'[second]} (m)")
        axes.set_title(title, fontsize=9, loc="left")

    return draw
