"""Stretching cables that vibrate: a fit with their slow part goes on with the full motion."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.model.elastic_motion import lengths_of
from freeswing.cdpr.model.known_values import with_effects
from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.decision import included
from freeswing.ident.diagnose.refit import Refit, colour_of, polished, ranked, rescored
from freeswing.ident.diagnose.variants import effect_of
from freeswing.ident.likelihood.blocks import STARTS, eased, effect_blocks, with_effect_values
from freeswing.ident.likelihood.fit_swings import LikelihoodFit, Swings
from freeswing.ident.likelihood.joint_problem import NotFollowedError

# Starts that pluck cables by so many times what they were held to are fitted again, held to that.
PLUCKED_MORE = 2.0
# A motion with vibration stands for one without where it has more than half of the probability.
MORE_LIKELY = 0.5


class Vibrating(NamedTuple):
    """A fit again with the full motion of an effect whose slow part it has.

    Attributes:
        fit: None where it cannot be followed.
        probability: that the full motion is there rather than its slow part.
        why: the slow part alone is taken, where it is.
    """

    fit: Refit | None
    probability: float
    why: str


def fully(slow: Refit, key: str, noise_scales: Array, colour: float) -> Refit:
    """A fit again with the full motion of an effect whose slow part it has, where that is likelier.

    Cables that stretch vibrate: at 4 to 11 Hz under 8 kg on EA = 15 to 100 kN, where tensions of a
    swing have parts at the same frequencies.

    Args:
        slow: the fit with the slow part, scored.
        key: the candidate's; where it has no other part, or none is there, the fit is as it was.
        noise_scales: of metres and radians, (2,).
        colour: of the residual by which both are weighed.
    """
    if not effect_named(effect_of(key)).fully:
        return slow
    found = vibrating(slow, key, noise_scales, colour)
    if found.fit is not None and found.probability > MORE_LIKELY:
        return found.fit
    return replace(slow, slowly=found.why)


def vibrating(slow: Refit, key: str, noise_scales: Array, colour: float) -> Vibrating:
    """The fit with the full motion, and how likely that is; see `fully`."""
    found = slow.fit
    name, where = effect_named(effect_of(key)).fully, found.model.place_of(effect_of(key))
    if not found.values[where][0] > 0.0:
        return Vibrating(None, 0.0, "cables that do not stretch do not vibrate")
    try:
        full = _plucked(found, name, noise_scales, colour)
    except (NotFollowedError, np.linalg.LinAlgError) as error:
        return Vibrating(None, 0.0, f"no motion with vibration follows the runs: {error}")
    # A line of the noise is as good as a vibration that rings for ever, and settles values by it.
    chance = included(slow, full, key, noise_scales)
    return Vibrating(full, chance, f"the runs do not show a vibration (probability {chance:.2g})")


def _plucked(found: LikelihoodFit, name: str, noise_scales: Array, colour: float) -> Refit:
    """The fit with the full motion, its starts held to pluck cables as much as is likeliest.

    Raises:
        NotFollowedError: when that cannot be simulated.
        LinAlgError: when a motion has no derivatives, at a singular pose.
    """
    model = with_effects(found.model, (name,))
    place, start = model.place_of(name), model.start_values
    values = np.array([np.append(one.values, start[place]) for one in found.motions])
    own = eased(model, found.inertia, values, found.value(STARTS))[:, lengths_of(model)]
    blocks = effect_blocks(model, name, start[place], np.zeros(len(start[place]), dtype=bool), own)
    swings, unknowns = Swings(model, found.samples, found.scales), found.unknowns.joined(*blocks)
    # Near a singularity a start that is a little off leads far away with all else free.
    begun = ranked(swings, unknowns.all_held(), found.cost)
    moved = {one.name: one.value for one in begun.unknowns.own}
    moving = ranked(replace(swings, motions=begun.motions), unknowns.moved(moved), found.cost)
    while True:
        full, usual = rescored(moving, noise_scales, colour), moving.values[place][0]
        size = full.evidence.plucked.likeliest()[0] if full.evidence.plucked else usual
        if size < PLUCKED_MORE * usual:
            return full
        values = moving.values
        values[place.start] = size
        unknowns = with_effect_values(moving.unknowns, model, values)
        moving = ranked(moving.swings, unknowns, moving.cost)


def fully_by_now(found: Refit, noise_scales: Array) -> Refit:
    """A fit again with the full motion of what an earlier round took the slow part of alone.

    Beside all that was missing then a vibration was not likelier; what is missing no more does not
    hide it.

    Args:
        found: the fit, converged.
        noise_scales: of metres and radians, (2,).
    """
    for name in found.effects:
        full = effect_named(name).fully
        if full and full not in found.effects:
            moving = fully(found, name, noise_scales, colour_of(found.fit, noise_scales))
            is_likelier = full in moving.effects
            found = polished(moving.fit, noise_scales) if is_likelier else found
    return found
