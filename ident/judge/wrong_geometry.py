"""What a robot file that is wrong does to an inertia: as much as it leaves in the residuals.

A diameter given for a radius, or an anchor measured from another corner, moves what all runs say
alike: no scatter between runs tells, and motions are followed to little more than the noise. The
residuals do tell that something is off, and by how much: errors of the cables' ends and pulleys are
taken for independent, in proportion to their tolerances, and as large as makes the residuals
likeliest. What errors of that size do to the inertia belongs to its deviations.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from freeswing.cdpr.frozen import freeze
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.robot import Array, Robot
from freeswing.ident.estimate import Estimate
from freeswing.ident.judge.asked_errors import GEOMETRY, asked_errors, shown, tolerance
from freeswing.ident.judge.likely_sizes import likely_sizes
from freeswing.ident.judge.missing_forces import FAR_FROM_WHITE, MissingForces
from freeswing.ident.judge.wider_estimate import wider
from freeswing.ident.likelihood.blocks import columns_of
from freeswing.ident.likelihood.cable_ends import GeometryPriors
from freeswing.ident.likelihood.fit_swings import LikelihoodFit

# In m and rad. What simulated swings without noise leave is rounding, 1e-7, and no cause's;
# trackers and cameras are off by 1e-5 and more.
LEAST_NOISE = 1e-6
ENDS = {"anchor_offset": "entry points", "attachment_offset": "attachment points"}


@dataclass(frozen=True, slots=True)
class WrongGeometry:
    """Errors of the cables' geometry, as large as residuals ask for.

    Attributes:
        size: in tolerances, of cable ends in the deviations that are stated where they are; zero
            where residuals need none.
        covariance: what errors of that size do to the inertia, (9, 9).
        stated: those deviations, by effect.
        unit: what errors of size one do to the inertia, (9, 9).
    """

    size: float
    covariance: Array
    stated: dict[str, float] = field(default_factory=dict)
    unit: Array = field(default_factory=lambda: np.zeros((9, 9)))

    def __post_init__(self) -> None:
        freeze(self, "covariance", "unit")

    def as_large_as(self, size: float) -> WrongGeometry:
        """The same where another fit of the session asks for errors of a size.

        Free coordinates do not show all that they are moved by.
        """
        if size <= self.size or not self.unit.any():
            return self
        return replace(self, size=size, covariance=size**2 * self.unit)


NOTHING_WRONG = WrongGeometry(0.0, np.zeros((9, 9)))


def doubts(found: LikelihoodFit) -> tuple[WrongGeometry, MissingForces]:
    """How large errors of the cables' geometry and missing forces a fit's residuals ask for.

    Args:
        found: the fit.
    """
    if np.nanmax(found.noise) < LEAST_NOISE:
        return NOTHING_WRONG, MissingForces()
    asked = asked_errors(found)
    colour = min(asked.colour, FAR_FROM_WHITE)
    sizes, left = likely_sizes(asked.answers, asked.seen, asked.causes, colour)
    moved = {name: asked.moved[:9, where] for name, where in asked.causes.items()}
    of_geometry, size = moved.pop(GEOMETRY), sizes.pop(GEOMETRY, 0.0)
    missing = MissingForces(sizes, moved, left)
    unit = of_geometry @ of_geometry.T
    return WrongGeometry(size, size**2 * unit, _stated(found.model), unit), missing


def geometry_of(robot: Robot, priors: GeometryPriors) -> Model:
    """The robot with its cables' geometry as values known as the size of errors is counted.

    Args:
        robot: as declared.
        priors: how well cable ends are known where that is stated; the rest by its tolerances.
    """
    model = build_model(robot, shown(robot))
    stds = {name: priors.stds.get(name, tolerance(robot, name)) for name in model.effects}
    spread = [stds[name] for name in model.effects for _ in columns_of(model, name)]
    parameters = tuple(
        one.known(0.0, std, "as stated, or tolerances of the robot file")
        for one, std in zip(model.parameters, spread, strict=True)
    )
    return replace(model, parameters=parameters)


def with_wrong_geometry(entry: Estimate, wrong: WrongGeometry) -> Estimate:
    """The estimate with deviations that hold what a wrong robot file does."""
    if wrong.size == 0.0:
        return entry
    return wider(entry, wrong.covariance, "geometry_std", lambda growth: _sentence(wrong, growth))


def with_doubts(
    entry: Estimate, found: LikelihoodFit
) -> tuple[Estimate, WrongGeometry, MissingForces]:
    """A fit's estimate, what a wrong robot file and missing forces do, or that it cannot be told.

    They are counted for the fits of the session together (`ident.fitted.with_missing`).
    """
    try:
        wrong, missing = doubts(found)
    except (ValueError, np.linalg.LinAlgError) as error:
        note = (
            "standard deviations hold nothing of what errors of robot.toml and missing forces do "
            f"to the inertia: the residuals could not be asked for them ({error})"
        )
        return replace(entry, notes=(*entry.notes, note)), NOTHING_WRONG, MissingForces()
    return entry, wrong, missing


def _sentence(wrong: WrongGeometry, growth: float) -> str:
    told = ", ".join(f"{1e3 * std:.3g} mm of {ENDS[name]}" for name, std in wrong.stated.items())
    unit = f" (as such count {told}, as stated)" if told else ""
    return (
        "the residuals are as if cable ends and pulleys of robot.toml were off by "
        f"{wrong.size:.2g} times their tolerances{unit}: standard deviations hold what errors of "
        f"that size do to the inertia, and are up to {growth:.1f} times as large for it; see what "
        "freeswing check and freeswing diagnose say"
    )


def _stated(model: Model) -> dict[str, float]:
    """The deviations of cable ends that a fit's priors state, by effect."""
    places = {name: columns_of(model, name) for name in ENDS if name in model.effects}
    stds = {name: model.parameters[where[0] - 9].prior_std for name, where in places.items()}
    return {name: std for name, std in stds.items() if std is not None}
