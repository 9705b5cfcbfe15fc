"""What the markers of a session were worth, as a result document."""

from __future__ import annotations

from typing import Any

import numpy as np

from freeswing.session.marker_runs import MarkerRuns


def marker_document(markers: MarkerRuns) -> dict[str, Any] | None:
    """Rigidity in micrometres by run and marker, None where there are no marker recordings."""
    if markers.target is None or markers.layout is None or not markers.runs:
        return None
    names = markers.target.marker_names
    entries = []
    for name, run in markers.runs.items():
        found, slow = run.examined.rigidity, run.trajectory.slow
        frame = np.zeros(6) if slow is None else np.sqrt(np.diag(slow.frame_covariance))
        entries.append(
            {
                "run": name,
                "rigidity_um": [_um(std) for std in found.std_m],
                "left_out": [names[k] for k in found.left_out],
                "all_um": _um(found.all_m),
                "kept_um": _um(found.kept_m),
                "frame_std_mm": [round(1e3 * float(value), 4) for value in frame[:3]],
                "frame_std_mrad": [round(1e3 * float(value), 4) for value in frame[3:]],
                "correlation_s": 0.0 if slow is None else slow.correlation_s,
            }
        )
    change = np.linalg.norm(markers.layout.change_m, axis=1)
    return {
        "names": list(names),
        "off_target_mm": [None if c != c else round(1e3 * float(c), 4) for c in change],
        "run_std_mm": round(1e3 * markers.layout.run_std_m, 5),
        "runs": entries,
    }


def _um(metres: float) -> float | None:
    return None if metres != metres else round(1e6 * float(metres), 2)
