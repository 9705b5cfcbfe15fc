"""A set of wrong places, and those that may be wrong instead."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from freeswing.ident.diagnose.refit import Refit
from freeswing.ident.diagnose.variants import effect_of

Places = tuple[str, ...]


def is_held_by(key: str, places: Sequence[str]) -> bool:
    """Whether a set has a place, by itself or with all of its kind."""
    return key in places or effect_of(key) in places


class Way(NamedTuple):
    """A set of places that may be wrong instead of what is told.

    Attributes:
        places: effects, or one cable's part of them.
        probability: among all such sets.
        fit: with it.
    """

    places: Places
    probability: float
    fit: Refit


class Exchange(NamedTuple):
    """What stands for a place that was found, and what may be wrong instead.

    Attributes:
        leader: the places that do, the one that says most by itself first; none where nothing was
            sure enough to be named.
        probability: of the leader.
        fits: with the first of them, the first two, and so on: the last one is the leader's.
        ways: sets that may be wrong instead; any effects where nothing is named.
    """

    leader: Places
    probability: float
    fits: tuple[Refit, ...]
    ways: tuple[Way, ...]

    def instead_of(self, key: str) -> tuple[str, ...]:
        """Effects that may be what is wrong instead of one of the leader's places."""
        ways = (way.places for way in self.ways if not is_held_by(key, way.places))
        names = (effect_of(one) for places in ways for one in places if one not in self.leader)
        return tuple(dict.fromkeys(names))
