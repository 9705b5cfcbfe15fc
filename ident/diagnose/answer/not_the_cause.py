"""Forces of an answer that are taken back together: the nearest candidates, not the cause."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.answer.taken_back import TakenBack
from freeswing.ident.diagnose.answer.unmet_validation import share_removed, unmet
from freeswing.ident.diagnose.backward_removal import is_no_worse
from freeswing.ident.diagnose.decision import (
    ACCEPTED,
    LEAST_SHARE_EXPLAINED,
    included,
    left_out,
)
from freeswing.ident.diagnose.heldout import HeldOut
from freeswing.ident.diagnose.refit import Refit, colour_of, polished, refit
from freeswing.ident.diagnose.search import Round
from freeswing.ident.diagnose.unexplained import Unexplained
from freeswing.ident.diagnose.variants import effect_of

GRAVITY = "gravity_scale"


def all_settled(accepted: Sequence[Round]) -> bool:
    """Whether an answer is nothing but the geometry that cable lengths have settled."""
    return all(one.by_lengths for one in accepted)


def before_forces(accepted: Sequence[Round]) -> Refit:
    """The fit that the first force was added to."""
    return next(one.before for one in accepted if not one.by_lengths)


def without_forces(accepted: Sequence[Round], why: str) -> TakenBack:
    """What lengths have settled alone: the fit before any force, and why no force counts."""
    names = [effect_of(one.decision.key) for one in accepted if not one.by_lengths]
    settled = [one for one in accepted if one.by_lengths]
    note = f"{', '.join(names)} {why}; not accepted"
    return TakenBack(before_forces(accepted), settled, note)


def removing_little(share: float, of_what: str) -> str:
    """Why forces that remove a share of something, 0 to 1, do not count."""
    return (
        f"would remove only {100 * share:.0f} % of the {of_what}: the nearest candidates, not the "
        "cause"
    )


def unless_validated(
    accepted: Sequence[Round], ladder: Sequence[HeldOut], rest: Unexplained
) -> TakenBack | None:
    """The answer without its forces where validation runs say that they are not the cause.

    Args:
        accepted: rounds of the search that count.
        ladder: validation runs before them and after each.
        rest: what the answer leaves of the fitted runs.
    """
    if all_settled(accepted):
        return None
    settled = sum(one.by_lengths for one in accepted)
    share = share_removed(ladder[settled], ladder[-1])
    if unmet(ladder[-1], rest.over_noise) is None or share >= LEAST_SHARE_EXPLAINED:
        return None
    return without_forces(accepted, removing_little(share, "validation runs' error"))


def gravity_instead(
    accepted: Sequence[Round], last: Refit, noise_scales: Array
) -> tuple[TakenBack, str] | None:
    """The answer without its forces where gravity of another strength, surely so, serves as well.

    A clock at another rate looks the same: a file is asked before the robot is blamed.

    Args:
        accepted: rounds of the search that count.
        last: its last fit.
        noise_scales: of metres and radians, (2,).

    Returns:
        What is left, and a sentence on what to check; None: forces say more.
    """
    if all_settled(accepted):
        return None
    before = before_forces(accepted)
    found = _under_other_gravity(before, noise_scales)
    if found is None or not is_no_worse(found, last, accepted[-1].decision.key, noise_scales):
        return None
    why = "cannot say more than gravity of another strength does"
    return without_forces(accepted, why), _to_check(found)


def gravity_unasked(
    accepted: Sequence[Round], last: Refit, is_missing: bool, noise_scales: Array
) -> str:
    """What to check where no force was accepted and gravity of another strength says what is left.

    Empty where nothing is missing, or where that surely helps but leaves more than a quarter of
    what runs left out are off beyond their noise: it stands in for something else.

    Args:
        accepted: rounds of the search that count.
        last: the last fit.
        is_missing: whether something that follows the motion still is.
        noise_scales: of metres and radians, (2,).
    """
    if not is_missing or not all_settled(accepted):
        return ""
    found = _under_other_gravity(last, noise_scales)
    if found is None or left_out(last, noise_scales).share(found.score) < LEAST_SHARE_EXPLAINED:
        return ""
    return _to_check(found)


def _under_other_gravity(before: Refit, noise_scales: Array) -> Refit | None:
    """A fit again under gravity of another strength; None: it surely has no other."""
    try:
        colour = colour_of(before.fit, noise_scales)
        found = refit(before.fit, GRAVITY, np.zeros(1), noise_scales, colour)
    except ValueError:  # no gravity lowers the cost
        return None
    found = polished(found.fit, noise_scales)
    return found if included(before, found, GRAVITY, noise_scales) >= ACCEPTED else None


def _to_check(found: Refit) -> str:
    stronger = float(found.fit.values[found.values_of(GRAVITY)][0])
    return (
        f"as if gravity were {100 * stronger:+.2f} % off what the robot's file says, or the "
        f"stamps' clock ran {abs(50 * stronger):.2f} % too {'slow' if stronger > 0 else 'fast'}: "
        "check the frame rate, the clock of the stamps, and gravity"
    )


def suspected(rest: Unexplained, check: str) -> Unexplained:
    """What remains, with what to check."""
    signature = f"{check}; {rest.signature}" if rest.signature else check
    return replace(rest, present=True, signature=signature)
