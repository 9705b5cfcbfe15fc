"""Which exchanges of a search are still open in its answer: what may be there instead of it."""

from __future__ import annotations

from collections.abc import Sequence

from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.refit import without
from freeswing.ident.diagnose.search import Round
from freeswing.ident.diagnose.sets.ways import Exchange, Way
from freeswing.ident.diagnose.variants import effect_of


def open_exchanges(
    rounds: Sequence[Round], accepted: Sequence[Round], noise_scales: Array
) -> list[Exchange]:
    """Those whose leader stands, as far as it does, and what came last and does not.

    Who takes back a place takes nothing from those that may be wrong instead of what is left of
    its set; where nothing is left they are there, unnamed, as long as nothing came after them.

    Args:
        rounds: of the search.
        accepted: those of them that count.
        noise_scales: of metres and radians, (2,).
    """
    standing = {one.decision.key for one in accepted}
    last = max((k for k, one in enumerate(rounds) if _is_among(one, accepted)), default=-1)
    found = []
    for index, one in enumerate(rounds):
        told = one.decision.exchange
        if told is None:
            continue
        left = tuple(key for key in told.leader if key in standing)
        if left and left == told.leader:
            found.append(told)
        elif left:
            found.append(_of_what_is_left(told, left, noise_scales))
        elif index > last:
            found.append(_unnamed(told, one))
    return found


def _of_what_is_left(told: Exchange, left: tuple[str, ...], noise_scales: Array) -> Exchange:
    """An exchange some of whose places were taken back."""
    if left == told.leader[: len(left)]:
        return told._replace(leader=left, fits=told.fits[: len(left)])
    stands = told.fits[-1]
    for name in {effect_of(key) for key in told.leader} - {effect_of(key) for key in left}:
        stands = without(stands.fit, name, noise_scales)
    return told._replace(leader=left, fits=(stands,))


def _unnamed(told: Exchange, done: Round) -> Exchange:
    """An exchange none of whose places is told: its leader is one of those that may be wrong."""
    if not told.leader:
        return told
    ways = (Way(told.leader, told.probability, told.fits[-1]), *told.ways)
    return Exchange((), 0.0, (done.before,), ways)


def _is_among(one: Round, several: Sequence[Round]) -> bool:
    return any(one is other for other in several)
