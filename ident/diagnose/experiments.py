"""Which experiment would tell effects apart that a session's data cannot."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from freeswing.cdpr.effects import Experiment, effect_named

OTHERWISE = (
    "record more runs, about other equilibria and with other amplitudes, and one with a known "
    "payload"
)


def separating_experiment(
    effects: tuple[str, ...], without: Sequence[Experiment] = (), otherwise: str = OTHERWISE
) -> str:
    """A sentence that names the experiments which would separate a group of effects.

    Each effect names those that set it apart; one that two of the group name serves.

    Args:
        effects: the group.
        without: what cannot be done with what hangs there.
        otherwise: what is said where none serves.
    """
    named = Counter(one for name in dict.fromkeys(effects) for one in _named_by(name))
    serving = (one for one, count in named.items() if count >= 2 and one not in without)
    found = sorted(serving, key=lambda one: one.rank)
    return "; or ".join(one.advice for one in found) or otherwise


def _named_by(name: str):
    return effect_named(name).separated_by
