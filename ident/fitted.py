"""Maximum-likelihood estimates of a session as they are told, and what all of them lack."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from freeswing.cdpr.robot import Array, Robot
from freeswing.ident.estimate import Estimate
from freeswing.ident.judge.missing_forces import (
    MissingForces,
    together,
    unreliable,
    with_missing_forces,
)
from freeswing.ident.judge.prediction import Prediction
from freeswing.ident.judge.wrong_geometry import WrongGeometry, with_wrong_geometry


@dataclass(frozen=True, slots=True)
class Fitted:
    """A maximum-likelihood estimate.

    Attributes:
        estimate: as it is reported.
        robot: with its cable ends where the fit found them.
        motions: its runs beside what it found for them.
        wrong: how large errors of the cables' geometry its residuals ask for.
        missing: which forces they ask for, and what these do.
    """

    estimate: Estimate
    robot: Robot
    motions: tuple[Prediction, ...]
    wrong: WrongGeometry
    missing: MissingForces = field(default_factory=MissingForces)


def with_missing(fitted: dict[str, Fitted]) -> dict[str, Fitted]:
    """Fits whose deviations hold what geometry and forces do that any of them asks for."""
    sizes = together([one.missing for one in fitted.values()])
    size, told = max((one.wrong.size for one in fitted.values()), default=0.0), {}
    for name, one in fitted.items():
        off = with_wrong_geometry(one.estimate, one.wrong.as_large_as(size))
        wider = with_missing_forces(off, one.missing, sizes)
        said = tuple(filter(None, [unreliable(one.missing)]))
        told[name] = replace(one, estimate=replace(wider, notes=(*said, *wider.notes)))
    return told


def moved_by_missing(fitted: dict[str, Fitted]) -> dict[bool, Array]:
    """What missing forces do to the inertia by full poses (True) and by free coordinates."""
    sizes = together([one.missing for one in fitted.values()])
    known = {name.endswith("full"): one.missing.changes(sizes) for name, one in fitted.items()}
    return {full: changes for full, changes in known.items() if len(changes)}
