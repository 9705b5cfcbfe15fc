"""Effects asked for on top of a session's file: the larger model, its unknowns, what is held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel, build_driven
from freeswing.cdpr.effects import driven_catalogue
from freeswing.ident.drive.diagnose.candidates import shown
from freeswing.ident.drive.identify import DriveSession
from freeswing.ident.drive.unknowns import Asked, Group

Array = NDArray[np.float64]

SAME = 1e-9  # of its length: what is left of a column that others can make


@dataclass(frozen=True, slots=True)
class Enlarged:
    """A session with effects.

    Attributes:
        session: its model has the effects at their start values, its unknowns their numbers last.
        held: unknowns of the file that the effects do as well: no longer asked for.
    """

    session: DriveSession
    held: tuple[str, ...]


def with_effects(
    session: DriveSession, labels: Sequence[str], starts: Sequence[tuple[str, float]] = ()
) -> Enlarged:
    """The session whose joint estimate has the numbers of effects too.

    Args:
        session: as its file says.
        labels: of effects: a name, for all motors or cables that it has; `name.part` for one;
            `name.parameter` for one number.
        starts: values where numbers of the effects start, or stay where they are not asked for.

    Raises:
        ValueError: for an effect, a part or a number that there is not, and for a start outside
            what is plausible.
    """
    known, wanted = driven_catalogue(), [label.partition(".")[0] for label in labels]
    for name in wanted:
        if name not in known:
            raise ValueError(f"--effect {name}: not one of {', '.join(sorted(known))}")
    old = session.model
    more = tuple(name for name in dict.fromkeys(wanted) if name not in old.effects)
    model = build_driven(old.robot, (*old.effects, *more))
    model = replace(model, declared=_started(model, starts))
    names = dict.fromkeys(name for label in labels for name in _asked_by(model, label))
    twice = [name for name in names if name in session.asked.members]
    if twice:
        raise ValueError(f"--effect: {twice[0]} is in [unknown] of the file already")
    added = tuple(Group(name, (name,)) for name in names)
    held = _held(model, session.asked, added)
    kept = [group for group in session.asked.groups if group.name not in held]
    n_kinematic = sum(group.name not in held for group in session.asked.kinematic.groups)
    asked = Asked((*kept, *added), n_kinematic, len(added))
    return Enlarged(replace(session, model=model, asked=asked), held)


def _asked_by(model: DrivenModel, label: str) -> list[str]:
    """Full names of the numbers that a label asks for."""
    name, _, part = label.partition(".")
    effect = driven_catalogue()[name]
    every = effect.parameters(model.robot)
    if not part:
        return [f"{name}.{one.name}" for one in shown(effect, model)]
    chosen = [one.name for one in every if part in (one.part, one.name)]
    if not chosen:
        parts = [one for one in dict.fromkeys(p.part for p in every) if one]
        there = [*parts, *(one.name for one in every)]
        raise ValueError(f"--effect {label}: {part!r} is not one of {', '.join(there)}")
    return [f"{name}.{one}" for one in chosen]


def _started(model: DrivenModel, starts: Sequence[tuple[str, float]]) -> Array:
    """The declared numbers with the effects' starts."""
    first, theta = len(model.numbers.names), model.declared.copy()
    own = model.names[first:]
    for name, value in starts:
        full = [one for one in own if name in (one, one.partition(".")[2])]
        if len(full) > 1:
            raise ValueError(f"--set {name}: is {' and '.join(full)}; write the effect's name too")
        if not full:
            raise ValueError(f"--set {name}: not one of {', '.join(own)}")
        limits = model.parameters[own.index(full[0])]
        if not limits.low <= value <= limits.high:
            raise ValueError(f"--set {name}={value:g}: outside {limits.low:g} to {limits.high:g}")
        theta[model.index(full[0])] = value
    return theta


def _held(model: DrivenModel, asked: Asked, added: tuple[Group, ...]) -> tuple[str, ...]:
    """Unknowns that change points and motors in no way in which the effects cannot.

    A drum radius of all motors and an addition to that of each are only known as their sum.
    """
    terms = model.premises.terms
    motors = [getattr(terms.motors, name) for name in type(terms.motors).__slots__]
    points = [*terms.geometry.entries, *terms.geometry.attachments]
    everything = ca.vertcat(*motors, *points, terms.body)
    theta = model.premises.theta
    slope = ca.Function("slope", [theta], [ca.jacobian(everything, theta)])
    matrix = np.asarray(ca.DM(slope(model.declared)).full())
    by_effects = matrix[:, [model.index(group.name) for group in added]]
    left, sizes, _ = np.linalg.svd(by_effects, full_matrices=False)
    base = left[:, sizes > SAME * sizes.max(initial=0.0)]
    held = []
    for group in asked.groups:
        column = matrix[:, [model.index(name) for name in group.members]].sum(axis=1)
        rest = column - base @ (base.T @ column)
        if np.linalg.norm(rest) <= SAME * np.linalg.norm(column):
            held.append(group.name)
    return tuple(held)
