"""Geometry that is known only so well: cable ends as further unknowns of the likelihood.

Entry points D and attachment points A are estimated with the inertia, their stated standard
deviations as priors about the declared places. What the swings do not tell of them widens the
inertia's standard deviations, which a geometry taken as exact makes too small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from freeswing.cdpr.measured.slow_errors import STATED_BY_RUN
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.robot import Array, Robot
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_swings import ONWARD, LikelihoodFit

_ENTRY, _ATTACHMENT = "anchor_offset", "attachment_offset"
_DECLARED = {"entry_std_m": "entry_m", "attachment_std_m": "attachment_m"}


@dataclass(frozen=True, slots=True)
class GeometryPriors:
    """How well the cables' ends are known, every coordinate; None: exactly.

    Attributes:
        entry_std_m: of D in the base frame.
        attachment_std_m: of A in the platform frame.
    """

    entry_std_m: float | None = None
    attachment_std_m: float | None = None

    def __post_init__(self) -> None:
        for name in ("entry_std_m", "attachment_std_m"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and 0.0 < value <= 0.1):
                raise ValueError(
                    f"{name} is {value}, must be above 0 and at most 0.1 m; leave it out where the "
                    "places are exact"
                )

    def or_declared(self, robot: Robot) -> GeometryPriors:
        """The same with what robot.toml states of cable ends where nothing is said here."""
        told = {
            name: getattr(robot.tolerances, tolerance)
            for name, tolerance in _DECLARED.items()
            if getattr(self, name) is None and tolerance in robot.tolerances.declared
        }
        return replace(self, **told)

    @property
    def stds(self) -> dict[str, float]:
        """By the effect that moves the points, those that are not exact."""
        known = {_ENTRY: self.entry_std_m, _ATTACHMENT: self.attachment_std_m}
        return {name: std for name, std in known.items() if std is not None}

    def model(self, robot: Robot, nuisances: Sequence[str] = ()) -> Model:
        """The robot's equations with its cable ends as values of known spread.

        Args:
            robot: as declared.
            nuisances: effects on what is measured that stand beside them, each run's own: known
                as well as the run states.
        """
        stds = self.stds
        model = build_model(robot, (*stds, *nuisances))
        spread = [stds.get(name.split(".")[0]) for name in model.names]
        parameters = tuple(
            replace(parameter, source=STATED_BY_RUN)
            if std is None
            else replace(parameter.known(0.0, std, "[tolerances] of robot.toml"), scale=std)
            for parameter, std in zip(model.parameters, spread, strict=True)
        )
        return replace(model, parameters=parameters)


def corrected(robot: Robot, model: Model, values: Array) -> Robot:
    """The robot with its cable ends where a fit has found them."""
    moves = {name: np.zeros((robot.n_cables, 3)) for name in (_ENTRY, _ATTACHMENT)}
    for name in moves.keys() & set(model.effects):
        moves[name] = values[model.place_of(name)].reshape(-1, 3)
    cables = tuple(
        replace(cable, entry_m=cable.entry_m + entry, attachment_m=cable.attachment_m + attachment)
        for cable, entry, attachment in zip(
            robot.cables, moves[_ENTRY], moves[_ATTACHMENT], strict=True
        )
    )
    return replace(robot, cables=cables)


def weighed_against_priors(found: LikelihoodFit, consistent: bool = False) -> LikelihoodFit:
    """The fit again with samples that count for no more than their coloured residuals are worth.

    A fit enlarges its covariance for colour, the priors' share included: good where priors are
    but a help. Cable ends would then come out farther from their declared places than their
    stated deviations allow, and less certain than stated.
    """
    if not len(found.values) or found.enlargement == 1.0 or found.rank < int(found.free.sum()):
        return found
    swings = replace(found.swings, scales=found.scales * np.sqrt(found.enlargement))
    again = fit(swings, found.unknowns, replace(ONWARD, consistent=consistent))
    return replace(again, covariance=again.covariance / again.enlargement)


def geometry_document(found: LikelihoodFit) -> dict[str, Any]:
    """`geometry` of an estimate's entry: each coordinate's correction; empty where it was exact."""
    stds = np.concatenate([np.zeros(0), *(found.std(name) for name in found.model.effects)])
    rows = [
        {"name": name, "value": float(value), "std": float(std), "prior_std": parameter.prior_std}
        for name, value, std, parameter in zip(
            found.model.names, found.values, stds, found.model.parameters, strict=True
        )
        if not parameter.per_run
    ]
    return {"geometry": rows} if rows else {}
