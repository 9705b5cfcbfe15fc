"""Panel: what was dropped and why."""

from __future__ import annotations

from typing import Any

from freeswing.report.material import Document, Material
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
        for kind in ("calibration", "tracking"):
            rows += _rows(kind, getattr(material, kind))
        if not material.documents:
            return None
        return {"rows": rows, "notes": material.notes}


def _rows(kind: str, document: Document) -> list[dict[str, str]]:
    return [
        {
            "what": str(entry.get("what") or entry.get("run") or entry.get("image") or ""),
            "where": kind,
            "why": str(entry.get("why", "")),
        }
        for entry in document.get("dropped") or []
    ]
