"""Where a platform hangs at given lengths, and a pose beside it to let it go from."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.statics import Equilibrium, equilibria, modes
from freeswing.cdpr.robot import Array

SWEEPS = 30
LENGTH_TOLERANCE_M = 1e-12
MOST_CORRECTION = 0.3  # of the wished displacement, to come back on the lengths


def rest_at_lengths(
    model: Model, lengths_m: Array, inertia: Array, values: Array, generator: np.random.Generator
) -> Equilibrium:
    """The lowest stable equilibrium with all cables taut.

    Raises:
        DataError: where there is none.
    """
    found = equilibria(model, generator, inertia, lengths_m=lengths_m, values=values)
    usable = [rest for rest in found if rest.stable and rest.taut]
    if not usable:
        raise DataError(
            f"no stable equilibrium with taut cables at lengths {np.round(lengths_m, 4)} m "
            f"({len(found)} equilibria found): change the lengths"
        )
    return usable[0]


def release(
    model: Model,
    rest: Equilibrium,
    inertia: Array,
    values: Array,
    amplitude_m: float,
    generator: np.random.Generator,
) -> Array:
    """A pose (6,) about `amplitude_m` from the equilibrium along its modes, on its lengths.

    Raises:
        DataError: where the lengths do not allow that pose.

    Source:
        FIDIM 2022, eqs. (38), (39): displaced along its modes; lengths kept by Newton's
        method.
    """
    shapes = modes(model, rest, inertia, values).shapes
    signs = generator.choice([-1.0, 1.0], shapes.shape[1])
    heading = shapes @ (generator.uniform(0.5, 1.0, shapes.shape[1]) * signs)
    step = heading * amplitude_m / np.linalg.norm(heading[:3])
    zeta = rest.zeta + step
    gap = np.full(model.robot.n_cables, np.inf)
    for _ in range(SWEEPS):
        outputs = evaluate(model.cables, zeta, values)
        gap = outputs[0] - rest.lengths_m
        if np.abs(gap).max() < LENGTH_TOLERANCE_M:
            break
        zeta = zeta - np.linalg.pinv(outputs[3]) @ gap
    correction = float(np.linalg.norm(zeta - rest.zeta - step))
    if np.abs(gap).max() > LENGTH_TOLERANCE_M or correction > MOST_CORRECTION * np.linalg.norm(
        step
    ):
        raise DataError(f"no pose {amplitude_m:g} m from rest on its lengths: swing less far")
    return zeta
