"""Which effects a driven robot could lack, motor by motor and cable by cable."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.effects import Effect, driven_catalogue, effect_named
from freeswing.cdpr.effects.base import Parameter
from freeswing.ident.drive.unknowns import Asked, Group

# A weight fixed to the platform moves its centre; how heavy it is alone cannot be told from the
# platform's own mass. These numbers answer to it where nothing is fixed yet.
CENTRE = ("com_x_m", "com_y_m", "com_z_m")


@dataclass(frozen=True, slots=True)
class Candidate:
    """One thing that may be missing.

    Attributes:
        effect: its name.
        part: the motor or cable, "" where it is of the whole robot.
        groups: its unknowns.
        screened: the numbers to which recordings answer where it is absent.
    """

    effect: str
    part: str
    groups: tuple[Group, ...]
    screened: tuple[str, ...]

    @property
    def label(self) -> str:
        """Effect and part."""
        return f"{self.effect}.{self.part}" if self.part else self.effect


def candidates(
    model: DrivenModel, asked: Asked, only: Collection[str] | None = None
) -> tuple[Candidate, ...]:
    """Everything in the catalogue that is not asked for already."""
    taken, found = set(asked.members), []
    for name in driven_catalogue() if only is None else only:
        effect = effect_named(name)
        parameters = [p for p in shown(effect, model) if f"{name}.{p.name}" not in taken]
        for part in dict.fromkeys(p.part for p in parameters):
            names = [f"{name}.{p.name}" for p in parameters if p.part == part]
            screened = tuple(names)
            if weighs(effect):
                screened = tuple(one for one in CENTRE if one not in taken)
            groups = tuple(Group(one, (one,)) for one in names)
            found.append(Candidate(name, part, groups, screened))
    return tuple(found)


def weighs(effect: Effect) -> bool:
    """Whether an effect fixes weights to the platform."""
    return type(effect).payloads is not Effect.payloads


def shown(effect: Effect, model: DrivenModel) -> list[Parameter]:
    """The parameters that a recording could tell, alone or (weights) with the others."""
    parameters = effect.parameters(model.robot)
    if weighs(effect):
        return list(parameters)
    found = []
    for k, parameter in enumerate(parameters):
        values = np.zeros(len(parameters))
        values[k] = parameter.scale
        stretches = type(effect).stretch is not Effect.stretch
        if parameter.amplitude and (not stretches or effect.stretch(values, 1.0)[0] > 0.0):
            found.append(parameter)
    return found
