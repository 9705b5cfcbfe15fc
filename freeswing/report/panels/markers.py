"""Panel: how rigid each marker is in each run, in micrometres."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from freeswing.report.figures import INK, figure
from freeswing.report.material import Material
from freeswing.report.words import number
from freeswing.results.identification import MarkerRun

MOST_WRITTEN = 40  # runs beyond which numbers in the cells no longer fit
LIGHT = 0.55  # of the colour scale, above which white text reads better


CAPTION = "Each marker's standard deviation about a rigid body in each run, um; x: left out."


class Markers:
    """Markers by runs, so that the one that lies and the run that it spoils meet the eye."""

    name = "markers"
    title = "How rigid the markers are"

    def values(self, material: Material) -> dict[str, Any] | None:
        """The picture and one row a run."""
        identification = material.identification
        found = None if identification is None else identification.markers
        if found is None or not found.runs:
            return None
        off = zip(found.names, found.off_target_mm, strict=True)
        return {
            "chart": _chart(found.names, found.runs),
            "rows": [_row(entry) for entry in found.runs],
            "off": ", ".join(f"{name} {size:.2f}" for name, size in off if size is not None),
            "run_std": number(found.run_std_mm),
        }


def _row(entry: MarkerRun) -> dict[str, str]:
    frame, turn = (max(std, default=0.0) for std in (entry.frame_std_mm, entry.frame_std_mrad))
    return {
        "run": entry.run,
        "all markers (µm)": number(entry.all_um),
        "those kept (µm)": number(entry.kept_um),
        "left out": ", ".join(entry.left_out),
        "platform frame, std": f"{frame:.2f} mm, {turn:.2f} mrad",
    }


def _chart(names: tuple[str, ...], runs: tuple[MarkerRun, ...]) -> object:
    sizes = np.array([[np.nan if v is None else float(v) for v in r.rigidity_um] for r in runs])
    known = sizes[sizes > 0.0]
    low, high = (float(known.min()), float(known.max())) if len(known) else (1.0, 10.0)

    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        norm = LogNorm(low, max(high, 2.0 * low))
        image = axes.imshow(sizes.T, norm=norm, cmap="YlOrBr", aspect="auto")
        axes.set_xticks(range(len(runs)), [run.run for run in runs], rotation=90)
        axes.set_yticks(range(len(names)), names)
        sheet.colorbar(image, ax=axes, label="um")
        for column, row in np.argwhere(np.isfinite(sizes)) if len(runs) <= MOST_WRITTEN else ():
            size = sizes[column, row]
            text = f"{size:.0f}" + ("x" if names[row] in runs[column].left_out else "")
            colour = "white" if norm(size) > LIGHT else INK
            axes.text(column, row, text, ha="center", va="center", fontsize=6, color=colour)

    return figure(draw, 4.6, 1.6 + 0.35 * len(names), CAPTION)
