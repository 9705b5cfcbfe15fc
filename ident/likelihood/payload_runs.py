"""Runs with a known payload beside runs without: what they add to the unknowns of the likelihood.

A payload of mass dm at p makes the platform's specific inertia x into (x + q (y + k)) / (1 + q),
with q = dm / m, y that of a point mass at p and k the payload's own inertia about its centre of
mass. Eqs. 23 and 24 of FIDIM 2022 are the first three rows. The unknowns are 1 / m, in which this
is close to linear, and k of every payload, of which nothing but its likely size is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.fidim.payload_mass import MassEstimate
from freeswing.ident.runs import Payload

# Moments and products of a payload's own inertia over its mass: those of a radius of 5 cm.
OWN_INERTIA_STD_M2 = 2.5e-3
HEAVIER = 10.0  # times the payload: a platform of unknown mass to start from
LEAST_SIGNIFICANCE = 2.0


@dataclass(frozen=True, slots=True)
class Loads:
    """The payloads of a set of runs and their unknowns: 1 / m, then six a payload.

    Attributes:
        payloads: the different ones.
        of_run: which of them a run carries, -1 for none, (runs,).
    """

    payloads: tuple[Payload, ...]
    of_run: tuple[int, ...]

    @classmethod
    def of(cls, payloads: Sequence[Payload | None]) -> Loads:
        """From the payload of every run."""
        different: dict[tuple[float, ...], Payload] = {}
        for one in payloads:
            if one is not None:
                different.setdefault(_key(one), one)
        places = {key: index for index, key in enumerate(different)}
        of_run = tuple(-1 if one is None else places[_key(one)] for one in payloads)
        return cls(tuple(different.values()), of_run)

    @property
    def count(self) -> int:
        """How many unknowns there are: none without payloads."""
        return 1 + 6 * len(self.payloads) if self.payloads else 0

    @property
    def unit(self) -> Array:
        """Typical sizes of the unknowns, (count,)."""
        if not self.payloads:
            return np.zeros(0)
        return np.concatenate(
            [self.start()[:1], np.full(6 * len(self.payloads), OWN_INERTIA_STD_M2)]
        )

    @property
    def prior_std(self) -> Array:
        """Standard deviations of the unknowns about zero, infinite for 1 / m, (count,)."""
        return np.where(np.arange(self.count) == 0, np.inf, OWN_INERTIA_STD_M2)

    def start(self, mass_kg: float | None = None) -> Array:
        """Where to start from, (count,)."""
        found = np.zeros(self.count)
        if self.payloads:
            heaviest = max(one.mass_kg for one in self.payloads)
            found[0] = 1.0 / (mass_kg or HEAVIER * heaviest)
        return found

    def inertia(self, run: int, inertia: Array, unknowns: Array) -> Array:
        """Specific inertia of platform and payload of a run together, (9,)."""
        which = self.of_run[run]
        if which < 0:
            return inertia
        payload = self.payloads[which]
        ratio = payload.mass_kg * unknowns[0]
        return (inertia + ratio * self._own(which, unknowns)) / (1.0 + ratio)

    def slopes(self, run: int, inertia: Array, unknowns: Array) -> tuple[Array, Array]:
        """Its derivatives by the platform's inertia, (9, 9), and by the unknowns, (9, count)."""
        by_inertia, by_unknowns = np.eye(9), np.zeros((9, self.count))
        which = self.of_run[run]
        if which < 0:
            return by_inertia, by_unknowns
        payload = self.payloads[which]
        ratio = payload.mass_kg * unknowns[0]
        change = self._own(which, unknowns) - inertia
        by_inertia /= 1.0 + ratio
        by_unknowns[:, 0] = payload.mass_kg * change / (1.0 + ratio) ** 2
        by_unknowns[3:, self._place(which)] = ratio / (1.0 + ratio) * np.eye(6)
        return by_inertia, by_unknowns

    def _own(self, which: int, unknowns: Array) -> Array:
        """Specific inertia of a payload alone about P, (9,)."""
        found = point_inertia(self.payloads[which].position_m)
        found[3:] += unknowns[self._place(which)]
        return found

    def _place(self, which: int) -> slice:
        """Where a payload's own six stand among the unknowns."""
        return slice(1 + 6 * which, 7 + 6 * which)


def point_inertia(position_m: Array) -> Array:
    """Specific inertia of a point mass, `INERTIA_NAMES` values, (9,).

    Source:
        Featherstone 2008, Rigid Body Dynamics Algorithms, sec. 2.13.
    """
    tensor = position_m @ position_m * np.eye(3) - np.outer(position_m, position_m)
    return np.concatenate([position_m, tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])


def mass_of(inverse_mass: float, std: float) -> MassEstimate:
    """The mass from its inverse.

    Raises:
        ValueError: where the inverse does not stand out from its deviation, with the numbers.
    """
    if not inverse_mass > LEAST_SIGNIFICANCE * std:
        raise ValueError(
            f"payload runs give 1 / mass = {inverse_mass:.3g} +- {std:.2g} 1/kg: no usable mass; "
            "put the payload farther from the centre of mass, or take a heavier one"
        )
    return MassEstimate(1.0 / inverse_mass, std / inverse_mass**2, None)


def _key(payload: Payload) -> tuple[float, ...]:
    return (payload.mass_kg, *payload.position_m)
