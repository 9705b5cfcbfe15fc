"""A fit's unknowns by name: inertia, effects, payloads; where they stand in its vectors.

What all runs share is one vector: the inertia's nine, the effects' values in the model's order, and
what payloads add. An effect whose values each run has for itself is there too, held at their root
mean square; the values of the runs are a block of their own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.ident.likelihood.joint_problem import INERTIA, INERTIA_UNIT, PAYLOADS, State
from freeswing.ident.likelihood.payload_runs import Loads
from freeswing.ident.likelihood.unknowns import Gaussian, Mask, Unknown, Unknowns
from freeswing.ident.runs import Payload


def each_run(effect: str) -> str:
    """Name of the block with an effect's values that each run has for itself."""
    return f"{effect}, each run"


def columns_of(model: Model, effect: str) -> NDArray[np.int64]:
    """Where an effect's values stand among the shared unknowns."""
    return len(INERTIA_UNIT) + np.arange(len(model.parameters))[model.place_of(effect)]


def shared_size(model: Model) -> int:
    """How many unknowns inertia and effects are."""
    return len(INERTIA_UNIT) + len(model.parameters)


def none_free(model: Model) -> Mask:
    """Inertia and effects all held: the runs' own unknowns are all there is."""
    return np.zeros(shared_size(model), dtype=bool)


def free_of(unknowns: Unknowns, model: Model) -> Mask:
    """Which of inertia and a model's effects are estimated, in the model's order."""
    return np.concatenate([unknowns.block(name).mask for name in (INERTIA, *model.effects)])


def inertia_block(inertia: Array, estimated: Mask) -> Unknown:
    """The nine, of which nothing is known beforehand."""
    return Unknown(INERTIA, inertia, INERTIA_UNIT, estimated=estimated)


def effect_blocks(
    model: Model, effect: str, values: Array, estimated: Mask, own: Array
) -> tuple[Unknown, ...]:
    """An effect's block, and that of the runs' own values where it has such.

    Args:
        model: that has it.
        effect: its name.
        values: all of its values, (k,).
        estimated: which of them are, (k,); those that each run has for itself are not.
        own: the values of those in every run, (runs, o).
    """
    parameters = model.parameters[model.place_of(effect)]
    start = np.array([p.start for p in parameters])
    spread = np.array([p.prior_std for p in parameters])
    scale = np.array([p.scale for p in parameters])
    mine = np.array([p.per_run for p in parameters])
    source = next((p.source for p in parameters if p.source), "the effect's plausible range")
    shared = Unknown(effect, values, scale, Gaussian(start, spread, source), estimated & ~mine)
    if not mine.any():
        return (shared,)
    prior = Gaussian(start[mine], spread[mine], source)
    return shared, Unknown(each_run(effect), own, scale[mine], prior, each_run=True)


def payload_block(loads: Loads, values: Array, estimated: Mask) -> Unknown:
    """One over the mass, of which nothing is known, and the payloads' own inertia."""
    prior = Gaussian(np.zeros(loads.count), loads.prior_std, "the likely size of payloads")
    return Unknown(PAYLOADS, values, loads.unit, prior, estimated)


def model_unknowns(
    model: Model, inertia: Array, values: Array, own: Array, loads: Loads, added: Array, free: Mask
) -> Unknowns:
    """All unknowns of a fit by name: inertia, a model's effects, what payloads add where there are.

    Args:
        model: with the effects.
        inertia: (9,).
        values: effect values, (k,).
        own: those that each run has for itself, (runs, o).
        loads: the runs' payloads.
        added: what they add, (u,).
        free: which of the shared ones are estimated, (9 + k + u,).
    """
    each = split_own(model, own)
    body, effects, payloads = np.split(free, np.cumsum([len(inertia), len(values)]))
    blocks = [inertia_block(inertia, body)]
    for name in model.effects:
        where = model.place_of(name)
        mine = each.get(name, np.zeros((len(own), 0)))
        blocks += effect_blocks(model, name, values[where], effects[where], mine)
    if loads.count:
        blocks.append(payload_block(loads, added, payloads))
    return Unknowns(tuple(blocks))


def first_unknowns(
    model: Model,
    inertia: Array,
    payloads: Sequence[Payload | None],
    values: Array | None = None,
    mass_kg: float | None = None,
) -> Unknowns:
    """Where a fit starts of which nothing but an inertia is guessed.

    Args:
        model: to be fitted.
        inertia: (9,).
        payloads: of each run.
        values: effect values, (k,); None for those that leave the declared model as it is.
        mass_kg: a guess of the mass, where runs carry payloads.
    """
    values = model.start_values if values is None else values
    loads, own = Loads.of(payloads), np.tile(values[model.own_values], (len(payloads), 1))
    free = np.ones(shared_size(model) + loads.count, dtype=bool)
    return model_unknowns(model, inertia, values, own, loads, loads.start(mass_kg), free)


def split_own(model: Model, own: Array) -> dict[str, Array]:
    """The runs' own values (runs, o) by effect, (runs, o of the effect); without those of none."""
    owner = np.array([model.names[k].partition(".")[0] for k in model.own_values], dtype=object)
    return {name: own[:, owner == name] for name in model.effects if (owner == name).any()}


def state_of(unknowns: Unknowns, model: Model, starts: Array, scales: Array) -> State:
    """A state to start a fit of a model from: its unknowns, and initial states of the runs.

    Args:
        unknowns: of the model: inertia, all of its effects, payloads where there are.
        model: to be fitted.
        starts: initial [zeta; rates] of each run, (runs, 12).
        scales: noise scales of metres and radians, (2,).
    """
    values = [unknowns.block(name).value for name in model.effects]
    runs = [unknowns.block(each_run(n)).value for n in model.effects if each_run(n) in unknowns]
    return State(
        unknowns.block(INERTIA).value,
        np.concatenate([np.zeros(0), *values]),
        starts,
        scales,
        own_values=np.hstack([np.zeros((len(starts), 0)), *runs]),
        loads=unknowns.block(PAYLOADS).value if PAYLOADS in unknowns else None,
    )
