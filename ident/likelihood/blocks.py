"""A free-swing fit's unknowns by name: inertia, effects, payloads, starts of the runs.

What all runs share is one vector: the inertia's nine, the effects' values in the model's order, and
what payloads add. An effect whose values each run has for itself is there too, held at their root
mean square; the values of the runs are a block of their own, and so are the runs' starts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.model.elastic_motion import at_ease
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.ident.likelihood.joint_problem import (
    INERTIA,
    INERTIA_UNIT,
    PAYLOADS,
    STATE_UNIT,
    State,
)
from freeswing.ident.likelihood.payload_runs import Loads
from freeswing.ident.likelihood.unknowns import Gaussian, Mask, Unknown, Unknowns
from freeswing.ident.runs import Payload

STARTS = "starts"  # [zeta; rates] of each run
MODES = "camera modes"  # amplitudes of the errors that a calibration does to all poses together


def each_run(effect: str) -> str:
    """Name of the block with an effect's values that each run has for itself."""
    return f"{effect}, each run"


def columns_of(model: Model, effect: str) -> NDArray[np.int64]:
    """Where an effect's values stand among the shared unknowns."""
    return len(INERTIA_UNIT) + np.arange(len(model.parameters))[model.place_of(effect)]


def shared_size(model: Model) -> int:
    """How many unknowns inertia and effects are."""
    return len(INERTIA_UNIT) + len(model.parameters)


def free_of(unknowns: Unknowns, model: Model) -> Mask:
    """Which of the shared unknowns are estimated: inertia, a model's effects, payloads, modes."""
    more = tuple(name for name in (PAYLOADS, MODES) if name in unknowns)
    names = (INERTIA, *model.effects, *more)
    return np.concatenate([unknowns.block(name).mask for name in names])


def inertia_block(inertia: Array, estimated: Mask) -> Unknown:
    """The nine, of which nothing is known beforehand."""
    return Unknown(INERTIA, inertia, INERTIA_UNIT, estimated=estimated)


def effect_blocks(
    model: Model, effect: str, values: Array, estimated: Mask, own: Array | None
) -> tuple[Unknown, ...]:
    """An effect's block, and that of the runs' own values where it has such.

    Args:
        model: that has it.
        effect: its name.
        values: all of its values, (k,).
        estimated: which of them are, (k,); those that each run has for itself are not.
        own: the values of those in every run, (runs, o); None: none.
    """
    parameters = model.parameters[model.place_of(effect)]
    start = np.array([p.start for p in parameters])
    spread = np.array([p.prior_std for p in parameters])
    scale = np.array([p.scale for p in parameters])
    mine = np.array([p.per_run for p in parameters])
    source = next((p.source for p in parameters if p.source), "the effect's plausible range")
    shared = Unknown(effect, values, scale, Gaussian(start, spread, source), estimated & ~mine)
    if own is None or not mine.any():
        return (shared,)
    prior = Gaussian(start[mine], spread[mine], source)
    return shared, Unknown(each_run(effect), own, scale[mine], prior, each_run=True)


def payload_block(loads: Loads, values: Array, estimated: Mask) -> Unknown:
    """One over the mass, of which nothing is known, and the payloads' own inertia."""
    prior = Gaussian(np.zeros(loads.count), loads.prior_std, "the likely size of payloads")
    return Unknown(PAYLOADS, values, loads.unit, prior, estimated)


def model_unknowns(model: Model, loads: Loads, state: State, free: Mask) -> Unknowns:
    """All unknowns of a fit by name: inertia, a model's effects, what payloads add, starts.

    Args:
        model: with the effects.
        loads: the runs' payloads.
        state: the values.
        free: which of the shared ones are estimated, (9 + k + u,).
    """
    runs, own, starts = range(len(state.starts)), model.own_values, state.starts
    each = split_own(model, np.array([state.values_of(run, own)[own] for run in runs]))
    body, effects, payloads = np.split(free, np.cumsum([len(state.inertia), len(state.values)]))
    blocks = [inertia_block(state.inertia, body)]
    for name in model.effects:
        where = model.place_of(name)
        mine = each.get(name, np.zeros((len(starts), 0)))
        blocks += effect_blocks(model, name, state.values[where], effects[where], mine)
    if loads.count:
        added = loads.start() if state.loads is None else state.loads
        blocks.append(payload_block(loads, added, payloads))
    blocks.append(Unknown(STARTS, starts, np.full(starts.shape[1], STATE_UNIT), each_run=True))
    return Unknowns(tuple(blocks)).known_together(model.effects, model.correlations)


def first_unknowns(
    model: Model,
    inertia: Array,
    starts: Array,
    payloads: Sequence[Payload | None],
    values: Array | None = None,
    mass_kg: float | None = None,
) -> Unknowns:
    """Where a fit starts of which nothing but an inertia and the runs' starts is guessed.

    Args:
        model: to be fitted.
        inertia: (9,).
        starts: initial [zeta; rates] of each run, (runs, 12).
        payloads: of each run.
        values: effect values, (k,); None for those that leave the declared model as it is.
        mass_kg: a guess of the mass, where runs carry payloads.
    """
    values = model.start_values if values is None else values
    loads = Loads.of(payloads)
    state = State(inertia, values, starts, np.ones(2), loads=loads.start(mass_kg))
    state = replace(state, own_values=eased(model, inertia, values, starts)[:, model.own_values])
    free = np.ones(shared_size(model) + loads.count, dtype=bool)
    return model_unknowns(model, loads, state, free)


def eased(model: Model, inertia: Array, values: Array, starts: Array) -> Array:
    """Values that each run begins with where no cable is plucked, (runs, k).

    Args:
        model: with or without springs.
        inertia: (9,).
        values: (k,), or (runs, k).
        starts: initial [zeta; rates] of each run, (runs, 12).
    """
    each = np.broadcast_to(values, (len(starts), len(model.parameters)))
    pairs = zip(starts, each, strict=True)
    return np.array([at_ease(model, one[:6], one[6:], inertia, its) for one, its in pairs])


def split_own(model: Model, own: Array) -> dict[str, Array]:
    """The runs' own values (runs, o) by effect, (runs, o of the effect); without those of none."""
    owner = np.array([model.names[k].partition(".")[0] for k in model.own_values], dtype=object)
    return {name: own[:, owner == name] for name in model.effects if (owner == name).any()}


def effect_values(unknowns: Unknowns, model: Model) -> Array:
    """The shared values of a model's effects, (k,)."""
    return np.concatenate([np.zeros(0), *(unknowns.block(name).value for name in model.effects)])


def with_effect_values(unknowns: Unknowns, model: Model, values: Array) -> Unknowns:
    """The same with other values (k,) of a model's effects, known as the model knows them."""
    for name in model.effects:
        where, block = model.place_of(name), unknowns.block(name)
        own = unknowns.block(each_run(name)).value if each_run(name) in unknowns else None
        for one in effect_blocks(model, name, values[where], block.mask, own):
            unknowns = unknowns.exchanged(one)
    return unknowns.known_together(model.effects, model.correlations)


def as_known(unknowns: Unknowns, model: Model, before: Unknowns) -> Unknowns:
    """The same with what others say is known of a model's effects beforehand."""
    for name in model.effects:
        unknowns = unknowns.known(name, before.block(name).prior)
    if before.correlations is None:
        return unknowns.known_together(model.effects, None)
    places = before.columns(*model.effects)
    return unknowns.known_together(model.effects, before.correlations[np.ix_(places, places)])


def state_of(unknowns: Unknowns, model: Model, scales: Array) -> State:
    """The values of a model's unknowns, as its joint problem has them.

    Args:
        unknowns: of the model: inertia, all of its effects, starts, payloads where there are.
        model: to be fitted.
        scales: noise scales of metres and radians, (2,).

    Raises:
        ValueError: when one of them is missing, naming it.
    """
    starts = unknowns.block(STARTS).value
    runs = [unknowns.block(each_run(n)).value for n in model.effects if each_run(n) in unknowns]
    return State(
        unknowns.block(INERTIA).value,
        effect_values(unknowns, model),
        starts,
        scales,
        own_values=np.hstack([np.zeros((len(starts), 0)), *runs]),
        loads=unknowns.block(PAYLOADS).value if PAYLOADS in unknowns else None,
    )


def refuse_others(unknowns: Unknowns, model: Model, loads: Loads) -> None:
    """Raises ValueError where a block is not what the model and the payloads make of it.

    What is known of effects is what their blocks say. Of inertia nothing is known, and starts and
    each run's own values are always estimated: a block that says otherwise would not be heard.
    """
    state = state_of(unknowns, model, np.ones(2))
    made = model_unknowns(model, loads, state, free_of(unknowns, model))
    made = as_known(made, model, unknowns)
    for block in unknowns.blocks:
        if block.name not in made:
            raise ValueError(f"no free swing has an unknown called {block.name!r}")
        if not block.is_known_as(made.block(block.name)):
            raise ValueError(f"unknown {block.name}: bounds, prior or mask are not the model's")
