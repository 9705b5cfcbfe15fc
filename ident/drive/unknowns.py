"""What is asked for: names of a driven robot's numbers, some of them tied to each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel

Array = NDArray[np.float64]

# How far from its start a number may go: Table 1's initial inertia is 33 times the robot's.
DYNAMIC_REACH = 1e3
KINEMATIC_REACH = 3.0


@dataclass(frozen=True, slots=True)
class Group:
    """One unknown: a number, or several held equal.

    Attributes:
        name: as in results: the first of `members`.
        members: names of the model's numbers.
    """

    name: str
    members: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Asked:
    """The unknowns in order.

    Attributes:
        groups: kinematic ones first.
        n_kinematic: how many of them are kinematic.
        added: names of those that are of effects asked for on top of the file.
    """

    groups: tuple[Group, ...]
    n_kinematic: int
    added: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """One name an unknown."""
        return tuple(group.name for group in self.groups)

    @property
    def reach(self) -> Array:
        """Times its start that each may end at, or one over it, (k,)."""
        kinematic = np.arange(len(self.groups)) < self.n_kinematic
        return np.where(kinematic, KINEMATIC_REACH, DYNAMIC_REACH)

    @property
    def kinematic(self) -> Asked:
        """Those of the geometry alone."""
        return Asked(self.groups[: self.n_kinematic], self.n_kinematic)

    @property
    def dynamic(self) -> Asked:
        """Those of the dynamics alone."""
        return Asked(self.groups[self.n_kinematic :], 0)

    @property
    def without_effects(self) -> Asked:
        """Those that the file asks for."""
        kept = [group.name not in self.added for group in self.groups]
        groups = tuple(group for group, keep in zip(self.groups, kept, strict=True) if keep)
        return Asked(groups, sum(kept[: self.n_kinematic]))

    @property
    def members(self) -> tuple[str, ...]:
        """All numbers that move, (m,)."""
        return tuple(name for group in self.groups for name in group.members)

    @property
    def spread(self) -> Array:
        """Which unknown moves which member, (m, len(groups)): slopes by members @ spread."""
        matrix = np.zeros((len(self.members), len(self.groups)))
        row = 0
        for column, group in enumerate(self.groups):
            matrix[row : row + len(group.members), column] = 1.0
            row += len(group.members)
        return matrix

    def read(self, model: DrivenModel, theta: Array) -> Array:
        """The unknowns' values in theta, (len(groups),)."""
        return np.array([theta[model.index(group.members[0])] for group in self.groups])

    def put(self, model: DrivenModel, theta: Array, values: Array) -> Array:
        """Theta with the unknowns at these values."""
        changed = np.array(theta, dtype=np.float64)
        for group, value in zip(self.groups, values, strict=True):
            for name in group.members:
                changed[model.index(name)] = value
        return changed


NOTHING = Asked((), 0)
