"""Measured beside predicted samples of the held-out runs, for the report and for plots."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdpr.model import build_model
from cdpr.robot import POSE_COORDINATES, Array, Robot
from ident.identify import Identification
from ident.prediction import predict
from ident.prepare import PreparedRun

MOST_RUNS = 8
RATE_HZ = 50.0


def predicted_motions(robot: Robot, found: Identification) -> dict[str, Any]:
    """`motion.json`: the first held-out runs, samples in m and rad, null where missing."""
    model = build_model(robot)
    inertia = found.estimates[found.best].values
    full = found.best.endswith("full")
    runs = [
        entry
        for run in found.prepared.runs
        if run.run.role == "validate" and run.run.payload is None
        if (entry := _entry(model, run, inertia, full)) is not None
    ]
    return {"format": "freeswing-motion/1", "runs": runs[:MOST_RUNS]}


def _entry(model, run: PreparedRun, inertia: Array, full: bool) -> dict[str, Any] | None:
    motion = run.full if full else run.free
    if motion is None:
        return None
    names = POSE_COORDINATES if full else motion.free
    inside = run.run.trajectory.window(float(motion.times_s[0]), float(motion.times_s[-1]))
    seen = inside.select(names)
    thinned = seen.take(np.arange(0, len(seen), max(1, round(seen.sample_rate_hz / RATE_HZ))))
    known = thinned.is_known
    times, samples = thinned.times_s[known], thinned.values[known]
    try:
        fit = predict(model, inertia, times, samples, names, motion.zetas[0], motion.rates[0])
    except (ValueError, np.linalg.LinAlgError):
        return None
    columns = [POSE_COORDINATES.index(name) for name in names]
    predicted = np.full_like(thinned.values, np.nan)
    predicted[known] = fit.motion.at(times)[0][:, columns]
    return {
        "run": run.name,
        "role": run.run.role,
        "times_s": thinned.times_s.tolist(),
        "coordinates": list(names),
        "measured": thinned.values,
        "before": predicted,
    }
