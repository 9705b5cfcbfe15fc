"""A driven session identified with effects that its file does not ask for."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.effects import driven_catalogue
from freeswing.cdpr.system.progress import Progress
from freeswing.ident.drive.asked_session import DriveSession
from freeswing.ident.drive.diagnose.candidates import weighs
from freeswing.ident.drive.diagnose.refit import MOST_STEPS, weighted
from freeswing.ident.drive.diagnose.screen import jump_start
from freeswing.ident.drive.elastic_search import best_start, followed, known_at_rest, stretches
from freeswing.ident.drive.identify import (
    DriveIdentification,
    apart,
    as_declared,
    clear_of_slack,
    geometry,
    offsets_of,
    possible,
    predictions,
    premise_of,
    ramps_of,
    step_1,
)
from freeswing.ident.drive.inverse_dynamics import Regression, inverse_dynamics
from freeswing.ident.drive.joint import Estimate, Premise, Problem, estimate
from freeswing.ident.drive.kinematics import Kinematics
from freeswing.ident.drive.predicted_run import HEAD_S
from freeswing.ident.drive.second_start import away
from freeswing.ident.drive.solver import MISFIT
from freeswing.ident.drive.unknowns import Asked

Array = NDArray[np.float64]

JUMP = "encoder_jump.after_s"


def identify_with_effects(session: DriveSession, progress: Progress) -> DriveIdentification:
    """The joint estimate of what the file asks for and of the effects' numbers.

    The file's numbers come first, without the effects; where those start is then told by what the
    residuals show (a step of an encoder) or by masses tried (a weight). The rest starts where the
    session puts it.

    Raises:
        ValueError: when the runs cannot be simulated from where a search begins.
    """
    asked = session.asked
    published, kinematics = step_1(session)
    elastic = _swings(session)
    regression, given = (_elastic_start if elastic else _rigid_start)(session, kinematics)
    started = given
    if not elastic or len({_of(name) for name in asked.added}) > 1:
        progress("without the effects", 0.1)
        started = _started(session, given, estimate(given, asked.without_effects, MOST_STEPS))
    search = followed if elastic else partial(_searched, given)
    progress("joint estimate", 0.4)
    joint, used = clear_of_slack(session, started, search(started, asked), search)
    started = replace(started, runs=used)
    progress("a second start", 0.65)
    elsewhere = apart(joint, search(_away(started, joint), asked))
    progress("predictions", 0.9)
    return DriveIdentification(
        None if elastic else published,  # static poses of rigid cables say nothing of elastic ones
        None if elastic else kinematics,
        regression,
        None,
        elsewhere,
        joint,
        used,
        predictions(session, joint),
        as_declared(session, given.offsets),
        ramps_of(session, joint),
    )


def _searched(given: Premise, started: Premise, asked: Asked) -> Estimate:
    """The estimate from a start, or by heads of the runs from what static poses tell of `given`.

    Without the effects whole runs pull the start far off: where the search from there leaves more
    than the noise, the other one is taken if it leaves less.
    """
    found = estimate(started, asked)
    at = found.found.normal
    if 2.0 * at.cost <= MISFIT * at.n:
        return found
    try:
        other = followed(known_at_rest(replace(given, runs=started.runs), asked), asked, HEAD_S)
    except ValueError:  # it loses the runs: the first one stands
        return found
    return min(found, other, key=lambda one: one.found.normal.cost)


def _rigid_start(
    session: DriveSession, kinematics: Kinematics | None
) -> tuple[Regression | None, Premise]:
    """Geometry by static poses, the file's other numbers by inverse dynamics where it succeeds."""
    theta, offsets = geometry(session, kinematics)
    regression = _regressed(session, theta, offsets)
    return regression, premise_of(session, _put(session, theta, regression), offsets)


def _elastic_start(
    session: DriveSession, kinematics: Kinematics | None
) -> tuple[Regression | None, Premise]:
    """Geometry and stretch together by static poses, and the better start of the other numbers.

    Inverse dynamics takes lengths let out for lengths: what it gives may be worse than the file.
    """
    fallback = None if kinematics is None else kinematics.offsets_rad
    offsets = offsets_of(session, session.model.declared, fallback)
    given = premise_of(session, session.model.declared, offsets)
    given = known_at_rest(replace(given, runs=session.of("identify")), session.asked)
    regression = _regressed(session, given.theta, given.offsets)
    starts = (given.theta, _put(session, given.theta, regression))
    return None, best_start(given, session.asked, starts)


def _put(session: DriveSession, theta: Array, regression: Regression | None) -> Array:
    """The numbers with what the regression gives of those that are possible."""
    if regression is None:
        return theta
    plain = session.asked.without_effects
    values = possible(replace(session, asked=plain), regression)
    return plain.dynamic.put(session.model, theta, values)


def _regressed(session: DriveSession, theta: Array, offsets: Array) -> Regression | None:
    """Inverse dynamics of the file's numbers, None where the angles fit no pose."""
    dynamic, runs = session.asked.without_effects.dynamic, list(session.of("identify"))
    try:
        return inverse_dynamics(session.model, theta, dynamic, runs, offsets)
    except ValueError:
        return None


def _started(session: DriveSession, given: Premise, first: Estimate) -> Premise:
    """Where the joint search begins."""
    model, asked = session.model, session.asked
    started = replace(given, theta=first.theta.copy(), offsets=first.offsets)
    if JUMP in model.names and JUMP not in asked.added and _untouched(session, JUMP):
        problem = Problem(given, first.asked)
        x = first.found.values.copy()
        x[: problem.k] = first.values
        problem.normal(x)
        started.theta[model.index(JUMP)] = jump_start(problem.seen, (JUMP,))[JUMP]
    for effect in driven_catalogue().values():
        groups = tuple(
            g for g in asked.groups if g.name in asked.added and _of(g.name) == effect.name
        )
        whole = len(groups) == len(effect.parameters(model.robot))
        if weighs(effect) and whole and all(_untouched(session, one.name) for one in groups):
            started = weighted(started, first, groups)
    return started


def _of(name: str) -> str:
    """The effect that a full name is of."""
    return name.partition(".")[0]


def _swings(session: DriveSession) -> bool:
    """Whether an effect is asked for that makes cables elastic."""
    return any(stretches(name) for name in session.asked.added)


def _untouched(session: DriveSession, name: str) -> bool:
    """Whether a number starts where the effect itself says."""
    model = session.model
    place = model.index(name)
    return model.declared[place] == model.parameters[place - len(model.numbers.names)].start


def _away(given: Premise, first: Estimate) -> Premise:
    """Numbers 5 % off an estimate, up and down in turn; not lengths, which then fit no pose."""
    asked = first.asked
    theta = asked.put(given.model, first.theta, away(first.values, held=asked.n_kinematic))
    return replace(given, theta=theta, offsets=first.offsets)
