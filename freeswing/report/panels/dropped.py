"""Panel: what was dropped and why."""

from __future__ import annotations

from typing import Any

from freeswing.report.grouped_notes import grouped
from freeswing.report.material import Material
from freeswing.report.words import ESTIMATES
from freeswing.results.identification import Estimate


class Dropped:
    """Runs, frames and cameras that were left out, and findings about the files."""

    name = "dropped"
    title = "What was dropped, and why"

    def values(self, material: Material) -> dict[str, Any] | None:
        """One row for each reason; nothing dropped is said too."""
        if not material.documents:
            return None
        rows = [
            _row(f"run {drop.run}", ESTIMATES[name], drop.why)
            for name, estimate in material.estimates.items()
            for drop in estimate.dropped_runs
        ]
        if material.calibration is not None:
            rows += [_row("view", "calibration", one) for one in material.calibration.dropped_views]
        runs = () if material.tracking is None else material.tracking.runs
        rows += [_row(f"run {run.run}", "tracking", one) for run in runs for one in run.problems]
        return {"rows": rows, "notes": grouped(_notes(material))}


def _row(what: str, where: str, why: str) -> dict[str, str]:
    return {"what": what, "left out of": where, "why": why}


def _notes(material: Material) -> list[str]:
    """What the estimates, the diagnosis and the check say beside their numbers.

    Without those of the best estimate: the panel "How sure" has them.
    """
    best = next(iter(material.estimates.values()), Estimate())
    every = () if material.identification is None else material.identification.notes
    session = [note for note in every if note not in best.notes]
    of_estimates = [
        f"{ESTIMATES[name]}: {note}"
        for name, estimate in list(material.estimates.items())[1:]
        for note in estimate.notes
    ]
    diagnosed = () if material.diagnosis is None else material.diagnosis.notes
    findings = () if material.check is None else material.check.findings
    checked = [f"{one.level} {one.subject}: {one.text}" for one in findings]
    return [*session, *of_estimates, *diagnosed, *checked]
