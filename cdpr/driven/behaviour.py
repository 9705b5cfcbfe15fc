"""A driven robot with all its effects: those of its equations, its cables and its instruments."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.elastic import Stretch, elastic_rest, out_at_rest, simulate_elastic
from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.driven.motion import DrivenMotion, simulate_driven
from freeswing.cdpr.driven.statics import static_pose
from freeswing.cdpr.effects import Effect, effect_named
from freeswing.cdpr.effects.base import Readings
from freeswing.cdpr.model.batch import evaluate

Array = NDArray[np.float64]


def effect_values(model: DrivenModel, theta: Array) -> list[tuple[Effect, Array]]:
    """Every effect of the model with its values."""
    first, found = len(model.numbers.names), []
    for name in model.effects:
        effect = effect_named(name)
        count = len(effect.parameters(model.robot))
        found.append((effect, theta[first : first + count]))
        first += count
    return found


def readings_of(model: DrivenModel, theta: Array, times_s: Array) -> Readings:
    """How the instruments err at these times."""
    found = Readings(times_s, 0.0, np.zeros((len(times_s), model.n_cables)))
    for effect, values in effect_values(model, theta):
        found = effect.readings(found, values)
    return found


def stretch_of(model: DrivenModel, theta: Array) -> Stretch | None:
    """How the cables give way, None where they do not."""
    mass, compliance, lag = float(theta[model.index("mass_kg")]), 0.0, 0.0
    for effect, values in effect_values(model, theta):
        more, late = effect.stretch(values, mass)
        compliance, lag = compliance + more, lag + late
    return Stretch(1.0 / compliance, lag) if compliance > 0.0 else None


def simulate(
    model: DrivenModel,
    state: Array,
    references_A: Array,
    rate_hz: float,
    theta: Array | None = None,
    *,
    currents_A: Array | None = None,
) -> DrivenMotion:
    """The motion under held current references, of elastic cables where an effect says so.

    Raises:
        ValueError: as `simulate_driven` and `simulate_elastic`.
    """
    theta = model.declared if theta is None else theta
    stretch = stretch_of(model, theta)
    if stretch is None:
        return simulate_driven(model, state, references_A, rate_hz, theta, currents_A=currents_A)
    return simulate_elastic(
        model, state, references_A, rate_hz, stretch, theta, currents_A=currents_A
    )


def rest_pose(model: DrivenModel, currents: Array, theta: Array | None = None) -> Array:
    """The pose at rest under held currents, (7,).

    Raises:
        ValueError: when there is none, or an elastic cable is slack there.
    """
    theta = model.declared if theta is None else theta
    stretch = stretch_of(model, theta)
    if stretch is None:
        return static_pose(model, currents, theta).pose
    return elastic_rest(model, currents, stretch, theta)


def turns_at_rest(model: DrivenModel, poses: Array, currents: Array, theta: Array) -> Array:
    """Lengths let out over drum radii at rest at poses (..., 7) under currents (..., n).

    Source:
        INCA 2016, eq. (2): the inverse kinematic model.
    """
    stretch = stretch_of(model, theta)
    if stretch is None:
        lengths = evaluate(model.lengths, poses, theta)[0]
    else:
        lengths = out_at_rest(model, poses, currents, stretch, theta)
    return lengths / evaluate(model.drums, theta)[0]
