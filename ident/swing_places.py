"""Where each swing took place: the equilibrium, its modes and how well the coordinates serve."""

from __future__ import annotations

from typing import Any

import numpy as np

from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.model.free_motion import amplification
from freeswing.cdpr.model.statics import equilibrium_at_lengths, modes
from freeswing.cdpr.robot import Array, Robot
from freeswing.ident.identify import Identification
from freeswing.ident.signals.usable_runs import PreparedRun


def swing_places(robot: Robot, found: Identification) -> list[dict[str, Any]]:
    """One entry for each usable run; its equilibrium is left out where none is near."""
    model = build_model(robot)
    inertia = found.estimates[found.best].values
    return [_place(model, run, found.free_coordinates, inertia) for run in found.prepared.runs]


def _place(model: Model, run: PreparedRun, free: tuple[str, ...], inertia: Array) -> dict[str, Any]:
    entry: dict[str, Any] = {"run": run.name, "role": run.run.role}
    motion = run.full if run.full is not None else run.free
    if motion is None:
        return entry
    middle = np.nanmean(motion.zetas, axis=0)
    rest = equilibrium_at_lengths(model, motion.lengths_m, middle, inertia)
    if rest is None or not rest.stable:
        return entry
    place = {"position_m": rest.zeta[:3].tolist(), "angles_rad": rest.zeta[3:].tolist()}
    return {
        **entry,
        "equilibrium": place,
        "frequencies_hz": modes(model, rest, inertia).frequencies_hz.tolist(),
        "conditioning": float(amplification(model, free, rest.zeta)),
    }
