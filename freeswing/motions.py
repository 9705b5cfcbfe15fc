"""Measured beside predicted samples of the held-out runs, for the report and for plots."""

from __future__ import annotations

from typing import Any

from ident.identify import Identification
from ident.prediction import Prediction

MOST_RUNS = 8


def predicted_motions(found: Identification) -> dict[str, Any]:
    """`motion.json`: the first held-out runs, samples in m and rad."""
    entries = [_entry(run.prediction) for run in found.validation if run.prediction is not None]
    return {"format": "freeswing-motion/1", "runs": entries[:MOST_RUNS]}


def _entry(prediction: Prediction) -> dict[str, Any]:
    return {
        "run": prediction.run,
        "role": "validate",
        "times_s": prediction.times_s.tolist(),
        "coordinates": list(prediction.coordinates),
        "measured": prediction.measured,
        "before": prediction.predicted,
    }
