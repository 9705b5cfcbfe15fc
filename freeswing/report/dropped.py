"""Panel: what was dropped and why."""

from __future__ import annotations

from typing import Any

from freeswing.report.material import Material
from freeswing.report.words import ESTIMATES


class Dropped:
    """Runs, frames and cameras that were left out, and findings about the files."""

    name = "dropped"
    title = "What was dropped, and why"

    def values(self, material: Material) -> dict[str, Any] | None:
        """One row for each reason; nothing dropped is said too."""
        rows = [
            {"what": f"run {entry['run']}", "where": ESTIMATES[name], "why": str(entry["why"])}
            for name, estimate in material.estimates.items()
            for entry in estimate.get("dropped_runs") or []
        ]
        views = material.calibration.get("dropped_views") or []
        rows += [{"what": "view", "where": "calibration", "why": str(view)} for view in views]
        rows += [
            {"what": f"run {run.get('run', '')}", "where": "tracking", "why": str(problem)}
            for run in material.tracking.get("runs") or []
            for problem in run.get("problems") or []
        ]
        if not material.documents:
            return None
        told = [*(material.identification.get("notes") or []), *_notes(material)]
        return {"rows": rows, "notes": list(dict.fromkeys([*told, *material.notes]))}


def _notes(material: Material) -> list[str]:
    """What the estimates and the diagnosis say beside their numbers."""
    of_estimates = [
        f"{ESTIMATES[name]}: {note}"
        for name, estimate in material.estimates.items()
        for note in estimate.get("notes") or []
    ]
    return [*of_estimates, *(material.diagnosis.get("notes") or [])]
