"""What an answer leaves in the residuals, and what that does to all that is told beside it.

The same as `identify` asks of its fits (`ident.judge`): residuals that are far from white say, to
first order, which errors of the robot file and which further forces they would need, and how large.
What those of that size do to the inertia and to the values of the effects found belongs to their
deviations, though none is sure enough to be named. Two things are known that `identify` does not
know. Where cable lengths were asked, what they do not settle is as good as its tolerances, whatever
forces act; elsewhere geometry is grossly off at most. And where effects were found that explain
most of the excess, all others were held against what they leave, and refused on runs left out: it
is a rest, as large as it is. A search of some candidates alone knows neither of what it left out.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.effects import Recorded, catalogue, effect_named
from freeswing.cdpr.frozen import freeze
from freeswing.cdpr.robot import INERTIA_NAMES, Array
from freeswing.ident.diagnose.answer.settled_geometry import settled_places
from freeswing.ident.judge.asked_errors import (
    GEOMETRY,
    Asked,
    asked_errors,
    shown,
)
from freeswing.ident.judge.likely_sizes import likely_sizes
from freeswing.ident.judge.missing_forces import FAR_FROM_WHITE
from freeswing.ident.judge.wrong_geometry import LEAST_NOISE
from freeswing.ident.likelihood.fit_swings import LikelihoodFit

AS_DECLARED = 1.0  # of its tolerances, which geometry is off where lengths have settled the rest


@dataclass(frozen=True, slots=True)
class StillMissing:
    """What a fit's residuals hold beside what is in its model.

    Attributes:
        sizes: of the causes that they ask for: `GEOMETRY` in tolerances of the robot file, others
            in their typical size.
        moved: what errors of these sizes do to the fit's shared unknowns, a covariance, (p, p).
        random: what a rest that others were refused for does, taken for random in the numbers that
            causes would show in, (p, p).
        left: power of that rest over white noise's.
        refused: whether other effects were held against it.
        failure: why residuals could not be asked; empty where they could.
    """

    sizes: dict[str, float]
    moved: Array
    random: Array
    left: float = 1.0
    refused: bool = False
    failure: str = ""

    def __post_init__(self) -> None:
        freeze(self, "moved", "random")

    def widened(self, covariance: Array) -> Array:
        """A covariance of the shared unknowns, (p, p), with all of it.

        What runs say apart is in there already; a rest acts on all of them alike beside that.

        Source:
            JCGM 100:2008, eq. (13): independent causes add by variance.
        """
        return covariance + self.moved + self.random

    def reliance(self, covariance: Array) -> str:
        """That values are not to be relied on, or how far, a sentence; empty where they are.

        Args:
            covariance: of the shared unknowns without it, (p, p).
        """
        if self.left < FAR_FROM_WHITE:
            return self.note(covariance)
        if self.refused:
            return (
                "do not take these values for more than their deviations say: something is still "
                f"missing, {self.left:.3g} times as strong as white noise would be in what a wrong "
                "model changes, and no force or geometry that the program knows follows it; "
                "deviations hold it as if it were random, which a force that acts as inertia is not"
            )
        return (
            "do not rely on these values: what is missing was not found, and to first order no "
            "force or geometry that is known here follows the residuals to within "
            f"{FAR_FROM_WHITE:g} times the power of white noise; deviations are as if they did"
        )

    def note(self, covariance: Array) -> str:
        """What deviations hold of it, or why they do not; empty where they need not.

        Args:
            covariance: of the shared unknowns without it, (p, p).
        """
        if self.failure:
            return (
                "standard deviations hold nothing of what errors of robot.toml and missing forces "
                f"do to the values: the residuals could not be asked for them ({self.failure})"
            )
        if not self.sizes:
            return ""
        named = [name for name in self.sizes if name != GEOMETRY]
        told = [f"{name} ({effect_named(name).summary})" for name in named]
        if GEOMETRY in self.sizes:
            told.append(
                "cable ends and pulleys of robot.toml that are off by "
                f"{self.sizes[GEOMETRY]:.2g} times their tolerances"
            )
        known, wider = (np.diag(c)[: len(INERTIA_NAMES)] for c in (covariance, self.moved))
        growth = np.sqrt(1.0 + (wider / np.where(known > 0.0, known, np.inf)).max())
        return (
            f"beside what is told the residuals are as if there were {', '.join(told)}: standard "
            "deviations hold what that would do, and those of the inertia are up to "
            f"{growth:.1f} times as large for it"
        )


def still_missing(
    found: LikelihoodFit,
    refused: bool,
    by_lengths: bool,
    candidates: Collection[str] | None = None,
) -> StillMissing:
    """What a fit leaves, and what that does to its shared unknowns.

    Args:
        found: the fit, as it is told.
        refused: whether effects were found in it that explain most of the excess, and all other
            candidates were refused beside them.
        by_lengths: whether cable lengths have settled the geometry among the candidates.
        candidates: effects that were looked for; None for all.
    """
    if candidates is not None:
        by_lengths = by_lengths and set(shown(found.model.robot)) <= set(candidates)
        refused = refused and _shown_by(found) <= {*candidates, *found.model.effects}
    nothing = np.zeros(found.covariance.shape)
    if np.nanmax(found.noise) < LEAST_NOISE:
        return StillMissing({}, nothing, nothing)
    try:
        asked = asked_errors(found, settled_places(found.model))
        sizes, left = likely_sizes(
            asked.answers,
            asked.seen,
            asked.causes,
            _most_left(asked, refused),
            {GEOMETRY: AS_DECLARED if by_lengths else found.model.robot.tolerances.gross},
        )
    except (ValueError, np.linalg.LinAlgError) as error:
        return StillMissing({}, nothing, nothing, failure=str(error))
    moved = nothing.copy()
    for name, size in sizes.items():
        change = size * asked.moved[:, asked.causes[name]]
        moved += change @ change.T
    # The fit's own covariance has the colour of its residuals already.
    is_rest = refused and left >= FAR_FROM_WHITE and np.isfinite(found.covariance).all()
    rest = found.covariance * (left / asked.colour) if is_rest else nothing
    return StillMissing(sizes, moved, rest, left, refused)


def _shown_by(found: LikelihoodFit) -> set[str]:
    """Effects that the recordings of a fit could show."""
    recorded = Recorded(lengths=any(run.lengths_m is not None for run in found.samples))
    robot = found.model.robot
    return {
        name
        for name, effect in catalogue().items()
        if not (effect.nuisance or effect.cannot_show(robot, recorded))
    }


def _most_left(asked: Asked, refused: bool) -> float:
    """Power that may be of no cause: of a rest all of it, else twice that of white noise."""
    if refused:
        return max(asked.colour, float(np.mean(asked.seen**2)))
    return min(asked.colour, FAR_FROM_WHITE)
