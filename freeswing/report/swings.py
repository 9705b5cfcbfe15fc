"""Panel: where the swings were. Equilibria, modes and how well the set is conditioned."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from freeswing.report.figures import AFTER, BEFORE, figure
from freeswing.report.material import Document, Material
from freeswing.report.words import number


class Swings:
    """The part of the workspace that the data have seen."""

    name = "swings"
    title = "Where the swings were"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Equilibria from above, modes and conditioning by run."""
        swings = list(material.identification.get("swings") or [])
        if not swings:
            return None
        costs = {
            name: number(estimate.get("cost_C")) for name, estimate in material.estimates.items()
        }
        return {
            "rows": [_row(entry) for entry in swings],
            "chart": _chart(swings, material.identification.get("entries_m") or []),
            "costs": {name: cost for name, cost in costs.items() if cost != "–"},
        }


def _row(entry: Document) -> dict[str, str]:
    equilibrium = entry.get("equilibrium") or {}
    return {
        "run": str(entry["run"]),
        "role": str(entry.get("role", "")),
        "position": "  ".join(number(v, 4) for v in equilibrium.get("position_m") or []),
        "angles": "  ".join(number(v, 3) for v in equilibrium.get("angles_rad") or []),
        "frequencies": "  ".join(number(v, 4) for v in entry.get("frequencies_hz") or []),
        "conditioning": number(entry.get("conditioning")),
    }


def _chart(swings: list[Document], entries: list[list[float]]) -> object:
    places = [
        (str(s.get("role", "")), s["equilibrium"]["position_m"])
        for s in swings
        if s.get("equilibrium")
    ]
    if not places:
        return ""

    def draw(sheet: Figure) -> None:
        above, side = sheet.subplots(1, 2)
        for axes, (first, second) in ((above, (0, 1)), (side, (0, 2))):
            for role, colour in (("identify", AFTER), ("validate", BEFORE)):
                points = [p for r, p in places if r == role]
                axes.plot(
                    [p[first] for p in points],
                    [p[second] for p in points],
                    "o",
                    ms=4,
                    color=colour,
                    label=role,
                )
            axes.plot(
                [p[first] for p in entries],
                [p[second] for p in entries],
                "k^",
                ms=5,
                label="pulley",
            )
            axes.set_aspect("equal", adjustable="datalim")
            axes.set_xlabel("x (m)")
        above.set_ylabel("y (m)")
        side.set_ylabel("z (m)")
        above.legend(fontsize=8)

    return figure(draw, 7.0, 3.0, "Equilibria of the runs among the pulleys, from above and aside.")
