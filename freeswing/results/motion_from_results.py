"""What motion.json and diagnosis_motion.json hold, from the results of identify and diagnose."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from freeswing.ident.diagnose.diagnose import Rung
from freeswing.ident.identify import Identification
from freeswing.ident.judge.prediction import Prediction
from freeswing.results.motion import Motion, RunMotion

MOST_RUNS = 8


def predicted_motions(found: Identification) -> Motion:
    """`motion.json`: the first held-out runs, and the first that were fitted."""
    entries = [_entry(run.prediction) for run in found.validation if run.prediction is not None]
    fitted = [{**_entry(one), "role": "identify"} for one in found.fitted]
    runs, own = (
        tuple(RunMotion.from_json(one) for one in some[:MOST_RUNS]) for some in (entries, fitted)
    )
    return Motion(runs=runs, fitted=own)


def ladder_motions(ladder: Sequence[Rung]) -> Motion:
    """`diagnosis_motion.json`: the same before the first effect and after the last."""
    after = {run.run: run.prediction for run in ladder[-1].held_out.runs}
    entries = []
    for run in ladder[0].held_out.runs:
        last = after.get(run.run)
        if run.prediction is None:
            continue
        entry = _entry(run.prediction)
        if len(ladder) > 1 and last is not None:
            entry["after"] = last.predicted
        entries.append(entry)
    return Motion(runs=tuple(RunMotion.from_json(one) for one in entries[:MOST_RUNS]))


def _entry(prediction: Prediction) -> dict[str, Any]:
    return {
        "run": prediction.run,
        "role": "validate",
        "times_s": prediction.times_s,
        "coordinates": list(prediction.coordinates),
        "measured": prediction.measured,
        "before": prediction.predicted,
    }
