"""Panel: how rigid each marker is in each run, in micrometres."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from freeswing.report.figures import INK, figure
from freeswing.report.material import Document, Material

MOST_WRITTEN = 40  # runs beyond which numbers in the cells no longer fit
LIGHT = 0.55  # of the colour scale, above which white text reads better


CAPTION = "Each marker's standard deviation about a rigid body in each run, um; x: left out."


class Markers:
    """Markers by runs, so that the one that lies and the run that it spoils meet the eye."""

    name = "markers"
    title = "How rigid the markers are"

    def values(self, material: Material) -> dict[str, Any] | None:
        """The picture and one row a run."""
        found = material.identification.get("markers") or {}
        runs = list(found.get("runs") or [])
        if not runs:
            return None
        off = zip(found["names"], found["off_target_mm"], strict=True)
        return {
            "chart": _chart([str(name) for name in found["names"]], runs),
            "rows": [_row(entry) for entry in runs],
            "off": ", ".join(f"{name} {size:.2f}" for name, size in off if size is not None),
            "run_std": f"{float(found['run_std_mm']):.3f}",
        }


def _row(entry: Document) -> dict[str, str]:
    frame, turn = max(entry["frame_std_mm"]), max(entry["frame_std_mrad"])
    return {
        "run": str(entry["run"]),
        "all": f"{float(entry['all_um']):.0f}",
        "kept": f"{float(entry['kept_um']):.0f}",
        "out": ", ".join(map(str, entry["left_out"])),
        "frame": f"{float(frame):.2f} mm, {float(turn):.2f} mrad",
    }


def _chart(names: list[str], runs: list[Document]) -> object:
    sizes = np.array([[np.nan if v is None else float(v) for v in r["rigidity_um"]] for r in runs])
    known = sizes[sizes > 0.0]
    low, high = (float(known.min()), float(known.max())) if len(known) else (1.0, 10.0)

    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        norm = LogNorm(low, max(high, 2.0 * low))
        image = axes.imshow(sizes.T, norm=norm, cmap="YlOrBr", aspect="auto")
        axes.set_xticks(range(len(runs)), [str(r["run"]) for r in runs], rotation=90)
        axes.set_yticks(range(len(names)), names)
        sheet.colorbar(image, ax=axes, label="um")
        for column, row in np.argwhere(np.isfinite(sizes)) if len(runs) <= MOST_WRITTEN else ():
            size = sizes[column, row]
            text = f"{size:.0f}" + ("x" if names[row] in runs[column]["left_out"] else "")
            colour = "white" if norm(size) > LIGHT else INK
            axes.text(column, row, text, ha="center", va="center", fontsize=6, color=colour)

    return figure(draw, 8.0, 1.6 + 0.35 * len(names), CAPTION)
