"""Stretch that is told by its slow part, beside a vibration that the runs do not show."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.robot import Array
from freeswing.ident.diagnose.refit import Refit, colour_of
from freeswing.ident.diagnose.sets.ways import Exchange, Way
from freeswing.ident.diagnose.springs.full_motion import MORE_LIKELY, vibrating

# Both motions have one stretch and one damping. Where these differ by more of their deviations, and
# runs do not speak for it, the full motion rings with a line of the noise: that was thirteen off,
# those that are right below two.
SAME_STRETCH = 3.0


class UnseenVibration(NamedTuple):
    """A vibration beside stretch that is told by its slow part.

    Attributes:
        exchange: what it makes of the values, as if it were sure.
        probability: that the runs show it.
    """

    exchange: Exchange
    probability: float

    @property
    def note(self) -> str:
        """What deviations hold of it."""
        (name,) = self.exchange.leader
        if self.probability > MORE_LIKELY:
            return (
                f"{name} is told by its slow part, as it was when it was found; beside all that is "
                f"told a vibration of the cables is likelier than none ({self.probability:.2g}): "
                "deviations hold what that would make of the values"
            )
        return (
            f"{name} is told by its slow part, since these runs do not show that cables vibrate "
            "beside it; deviations hold what that would make of the values"
        )


def unseen_vibration(last: Refit, noise_scales: Array) -> UnseenVibration | None:
    """What the vibration of stretching cables makes of a fit with their slow part alone.

    Cables that stretch vibrate whether runs show it or not, and the slow part is a little off for
    it where it leaves nothing but noise: by up to three of its deviations. So it counts as if it
    were sure, and not by its probability.

    Args:
        last: the fit.
        noise_scales: of metres and radians, (2,).

    Returns:
        None where no effect of the fit has its slow part alone, or no vibration goes with it.
    """
    for name in last.effects:
        fuller = effect_named(name).fully
        if fuller and fuller not in last.effects:
            colour = colour_of(last.fit, noise_scales)
            full, chance, _ = vibrating(last, name, noise_scales, colour)
            if full is not None and (chance > MORE_LIKELY or _is_same(last, full, name)):
                told = Exchange((name,), 0.0, (last,), (Way((fuller,), 1.0, full),))
                return UnseenVibration(told, chance)
    return None


def _is_same(slow: Refit, full: Refit, name: str) -> bool:
    """Whether two fits tell an effect's values alike, each by its deviations."""
    away = full.fit.value(name) - slow.fit.value(name)
    spread = np.hypot(full.fit.std(name), slow.fit.std(name))
    return bool((np.abs(away) <= SAME_STRETCH * spread).all())
