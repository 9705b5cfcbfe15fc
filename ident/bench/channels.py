"""Uncalibrated signals: offset + gains x coordinates, squares and cubes where asked.

A laser dot on a flat wall, seen by a camera askew, is a smooth map of the pose; near the rest pose
its Taylor polynomial is what can be told from a swing. With squares alone a curved map is taken
for amplitude, and a free gain follows it: cubes keep the gain honest.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations_with_replacement
from types import MappingProxyType

import numpy as np

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.robot import POSE_COORDINATES, Array

HIGHEST_ORDER = 3  # at six degrees a fourth power leaves 1e-4 of the amplitude
LEAST_OVER_NOISE = 5.0  # a channel's spread over the noise between its neighbours


@dataclass(frozen=True, slots=True)
class Channel:
    """A signal of unknown scale and zero.

    Attributes:
        name: label.
        column: of the runs' trajectory files.
        coordinates: what it may respond to.
        order: 1, 2 or 3.
        gains: known ones, column units per m or rad, by coordinate.
        gains_std: how well, by coordinate; a known gain without one is exact.
        per_run: whether unknown gains are new in every run.
    """

    name: str
    column: str
    coordinates: tuple[str, ...]
    order: int = 1
    gains: Mapping[str, float] = field(default_factory=dict)
    gains_std: Mapping[str, float] = field(default_factory=dict)
    per_run: bool = False

    def __post_init__(self) -> None:
        unknown = [name for name in self.coordinates if name not in POSE_COORDINATES]
        if unknown or not self.coordinates or len(set(self.coordinates)) < len(self.coordinates):
            raise ValueError(
                f"channel {self.name}: coordinates {list(self.coordinates)} must be different "
                f"names out of {', '.join(POSE_COORDINATES)}"
            )
        if self.order not in range(1, HIGHEST_ORDER + 1):
            raise ValueError(f"channel {self.name}: order is {self.order}, must be 1, 2 or 3")
        for what, given in (("gains", self.gains), ("gains_std", self.gains_std)):
            strange = [name for name in given if name not in self.coordinates]
            if strange:
                raise ValueError(
                    f"channel {self.name}: {what} of {', '.join(strange)}, which is not among its "
                    f"coordinates {', '.join(self.coordinates)}"
                )
        self._check_gains()
        object.__setattr__(self, "gains", MappingProxyType(dict(self.gains)))
        object.__setattr__(self, "gains_std", MappingProxyType(dict(self.gains_std)))

    def _check_gains(self) -> None:
        main = self.main_coordinate
        if self.gains.get(main) == 0.0:
            raise ValueError(
                f"channel {self.name}: gains of {main} is 0: it would show no swing; leave gains "
                "out where they are not known"
            )
        without = [name for name in self.gains_std if name not in self.gains]
        if without:
            raise ValueError(
                f"channel {self.name}: gains_std of {', '.join(without)} without gains of it: give "
                "both, or neither"
            )
        exact = [name for name, std in self.gains_std.items() if not std > 0.0]
        if exact:
            raise ValueError(
                f"channel {self.name}: gains_std of {', '.join(exact)} must be above 0; leave it "
                "out where the gain is exact"
            )

    @property
    def terms(self) -> tuple[tuple[int, ...], ...]:
        """The polynomial's terms as places among `coordinates`: (0,), (1,), (0, 0), (0, 1) .."""
        places = range(len(self.coordinates))
        return tuple(
            term
            for degree in range(1, self.order + 1)
            for term in combinations_with_replacement(places, degree)
        )

    @property
    def term_names(self) -> tuple[str, ...]:
        """Names of the terms: chi, x, chi*chi, chi*x .."""
        return tuple("*".join(self.coordinates[k] for k in term) for term in self.terms)

    @property
    def main_coordinate(self) -> str:
        """The coordinate that it answers to most: chi, or an angle, where there is one."""
        angles = [name for name in self.coordinates if name in POSE_COORDINATES[3:]]
        return "chi" if "chi" in angles else (angles or list(self.coordinates))[0]

    @property
    def columns(self) -> list[int]:
        """Places of its coordinates in the pose."""
        return [POSE_COORDINATES.index(name) for name in self.coordinates]

    def design(self, moved: Array) -> Array:
        """The terms (n, terms) of poses (n, 6) given from the rest pose."""
        own = moved[:, self.columns]
        return np.stack([np.prod(own[:, term], axis=1) for term in self.terms], axis=1)

    def slopes(self, moved: Array, gains: Array) -> Array:
        """Derivatives of the signal by the pose, (n, 6)."""
        own, found = moved[:, self.columns], np.zeros(moved.shape)
        for gain, term in zip(gains, self.terms, strict=True):
            for place in range(len(term)):
                rest = term[:place] + term[place + 1 :]
                found[:, self.columns[term[place]]] += gain * np.prod(own[:, rest], axis=1)
        return found


def check_moves(run: str, column: str, values: Array) -> None:
    """Refuses a channel that never leaves its noise in a run.

    Args:
        run: its name.
        column: of the channel.
        values: its samples, (n,).

    Raises:
        DataError: naming both.
    """
    known = values[np.isfinite(values)]
    if len(known) < 20:
        raise DataError(f"run {run}: channel column {column} holds {len(known)} samples")
    # Second differences: a swing's own curvature between neighbours is far below its size.
    noise = float(np.std(np.diff(known, 2))) / np.sqrt(6.0)
    spread = float(np.std(known))
    if not spread > LEAST_OVER_NOISE * noise:
        raise DataError(
            f"run {run}: channel column {column} never moves above its noise: it "
            f"spreads by {spread:.3g}, its noise is {noise:.3g} ({LEAST_OVER_NOISE:g} times that "
            "is needed); twist wider, or leave the channel out"
        )
