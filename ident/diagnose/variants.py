"""Candidates of a search: an effect, or one cable's part of an effect ("attachment_offset:2").

What one cable alone has wrong needs a fraction of the unknowns; an effect that is given all cables
spends the others on whatever else the model lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.robot import Robot


def effect_of(key: str) -> str:
    """The effect's name."""
    return key.partition(":")[0]


def variants(robot: Robot, name: str) -> list[str]:
    """The keys of an effect: the whole of it, then each cable's part where it has several."""
    parts = dict.fromkeys(p.part for p in effect_named(name).parameters(robot) if p.part)
    return [name, *(f"{name}:{part}" for part in parts)] if len(parts) > 1 else [name]


def inside(robot: Robot, key: str) -> np.ndarray:
    """Which of its effect's parameters a key estimates, (k,) booleans."""
    name, _, part = key.partition(":")
    return np.array([part in ("", p.part) for p in effect_named(name).parameters(robot)])


def extended(model: Model, names: Sequence[str]) -> Model:
    """A model with further effects; what is known of those that it has stays known."""
    more = build_model(model.robot, (*model.effects, *names))
    known = model.parameters
    parameters = (*known, *more.parameters[len(known) :])
    together = model.correlations
    if together is not None:
        together = np.eye(len(parameters))
        together[: len(known), : len(known)] = model.correlations
    return replace(more, parameters=parameters, correlations=together)


def reduced(model: Model, name: str) -> Model:
    """A model without one of its effects."""
    where = model.place_of(name)
    fewer = build_model(model.robot, tuple(other for other in model.effects if other != name))
    kept = (*model.parameters[: where.start], *model.parameters[where.stop :])
    together = model.correlations
    if together is not None:
        place = np.arange(len(model.parameters))[where]
        together = np.delete(np.delete(together, place, axis=0), place, axis=1)
    return replace(fewer, parameters=kept, correlations=together)
