"""Effects asked for on top of a session's file: the larger model, its unknowns, what is held."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel, build_driven
from freeswing.cdpr.effects import driven_catalogue
from freeswing.ident.drive.asked_session import DriveSession
from freeswing.ident.drive.diagnose.candidates import shown
from freeswing.ident.drive.unknowns import Asked, Group

Array = NDArray[np.float64]

SAME = 1e-9  # of its length: what is left of a column that others can make


@dataclass(frozen=True, slots=True)
class Enlarged:
    """A session with effects.

    Attributes:
        session: its model has the effects at their start values; those of their numbers that
            move points or drums are kinematic unknowns, the others dynamic ones.
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
    slopes = _slopes(model)
    held = _held(model, session.asked, names, np.vstack(slopes))
    kept = [group for group in session.asked.groups if group.name not in held]
    n_kinematic = sum(group.name not in held for group in session.asked.kinematic.groups)
    moving = [name for name in names if slopes[0][:, model.index(name)].any()]
    groups = {name: Group(name, (name,)) for name in names}
    still = [groups[name] for name in names if name not in moving]
    kinematic = [*kept[:n_kinematic], *(groups[name] for name in moving)]
    asked = Asked((*kinematic, *kept[n_kinematic:], *still), len(kinematic), tuple(names))
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


def _slopes(model: DrivenModel) -> tuple[Array, Array]:
    """How points and drums, and all other constants of motors and body, answer to theta."""
    terms, theta = model.premises.terms, model.premises.theta
    points = ca.vertcat(*terms.geometry.entries, *terms.geometry.attachments)
    rest = [name for name in type(terms.motors).__slots__ if name != "drum_radius"]
    motors = ca.vertcat(*[getattr(terms.motors, name) for name in rest])
    parts = [ca.vertcat(points, terms.motors.drum_radius), ca.vertcat(motors, terms.body)]
    slope = ca.Function("slope", [theta], [ca.jacobian(part, theta) for part in parts])
    first, second = (np.asarray(ca.DM(one).full()) for one in slope(model.declared))
    return first, second


def _held(model: DrivenModel, asked: Asked, added: Iterable[str], slopes: Array) -> tuple[str, ...]:
    """Unknowns that change points, motors and body in no way in which the effects cannot.

    A drum radius of all motors and an addition to that of each are only known as their sum.
    """
    by_effects = slopes[:, [model.index(name) for name in added]]
    left, sizes, _ = np.linalg.svd(by_effects, full_matrices=False)
    base = left[:, sizes > SAME * sizes.max(initial=0.0)]
    held = []
    for group in asked.groups:
        column = slopes[:, [model.index(name) for name in group.members]].sum(axis=1)
        rest = column - base @ (base.T @ column)
        if np.linalg.norm(rest) <= SAME * np.linalg.norm(column):
            held.append(group.name)
    return tuple(held)
