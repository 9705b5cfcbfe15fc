"""Motor angles at rest with their slopes, of cables that may give way."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.behaviour import stretch_of, turns_at_rest
from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.driven.slopes import length_slope, moved, pose_map
from freeswing.cdpr.model.batch import evaluate
from freeswing.ident.drive.run_problem import POSE_STEP, gives_way, step_of
from freeswing.ident.drive.unknowns import Asked

Array = NDArray[np.float64]


def turns_and_slopes(
    model: DrivenModel, pose: Array, currents: Array, theta: Array, asked: Asked
) -> tuple[Array, Array, Array]:
    """L / r let out at rest (n,), its slopes by the pose's small moves (n, 6) and unknowns (n, k).

    Rigid cables' slopes are exact. Elastic ones are longer by what their motors pull: their slopes
    are differences of closed forms.

    Source:
        INCA 2016, eq. (2) and, by differences where cables give way, Press et al. 2007,
        Numerical Recipes, sec. 5.7.
    """
    turns = turns_at_rest(model, pose, currents, theta)
    rigid = stretch_of(model, theta) is None
    if rigid and not any(gives_way(model, name) for name in asked.members):
        found = evaluate(length_slope(model, asked.members), pose, theta)
        by_asked = found[2] @ asked.spread if asked.members else np.zeros((len(turns), 0))
        return turns, found[1] @ pose_map(pose), by_asked
    by_pose = [
        (turns_at_rest(model, moved(pose, POSE_STEP * one), currents, theta) - turns) / POSE_STEP
        for one in np.eye(6)
    ]
    by_asked = np.zeros((len(turns), len(asked.groups)))
    for k, group in enumerate(asked.groups):
        other, step = theta.copy(), step_of(model, theta, group.name)
        other[[model.index(name) for name in group.members]] += step
        by_asked[:, k] = (turns_at_rest(model, pose, currents, other) - turns) / step
    return turns, np.stack(by_pose, axis=-1), by_asked
