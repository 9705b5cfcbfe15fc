"""Runs along which a cable would have to push by every inertia that the swings allow."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.ident.fidim.fidim import FidimEstimate
from freeswing.ident.signals.motions import lowest_tension
from freeswing.ident.signals.usable_runs import (
    PreparedRuns,
)

# Two standard deviations: what the swings themselves leave open.
REACH = 2.0


def within_reach(raw: FidimEstimate) -> Array:
    """The estimate and what lies `REACH` deviations off along its principal axes, (19, 9).

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3: principal axes of a
        Gaussian.
    """
    sizes, axes = np.linalg.eigh(raw.solution.covariance)
    steps = REACH * (axes * np.sqrt(np.maximum(sizes, 0.0))).T
    return np.concatenate([raw.values[None], raw.values + steps, raw.values - steps])


def slack_runs(model: Model, prepared: PreparedRuns, inertias: Array, full: bool) -> dict[str, str]:
    """Runs along which a cable pushes by every inertia that the swings allow: name and sentence.

    An inertia that they do not determine may make any cable push, and proves nothing.
    """
    slack = {}
    for run in prepared.runs:
        # Measured poses settle it; free coordinates only where there is nothing better.
        if not full and run.full is not None:
            continue
        motion = run.full if full else run.free
        if motion is None or run.run.payload is not None:
            continue
        lowest, cable = lowest_tension(model, motion, inertias[0])
        if lowest < 0.0 and all(lowest_tension(model, motion, one)[0] < 0.0 for one in inertias):
            slack[run.name] = (
                f"cable {cable} goes slack: its tension falls to {lowest:.2f} N per kg of platform"
            )
    return slack
