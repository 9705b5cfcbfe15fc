"""A driven session identified with effects that its file does not ask for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from freeswing.cdpr.effects import Effect, driven_catalogue
from freeswing.ident.drive.diagnose.candidates import weighs
from freeswing.ident.drive.diagnose.refit import MOST_STEPS, weighted
from freeswing.ident.drive.diagnose.screen import jump_start
from freeswing.ident.drive.identify import (
    SECOND_START,
    DriveIdentification,
    DriveSession,
    Progress,
    geometry,
    offsets_of,
    possible,
    predict,
    predicted_as_declared,
    step_1,
)
from freeswing.ident.drive.inverse_dynamics import Regression, inverse_dynamics
from freeswing.ident.drive.joint import Estimate, Premise, Problem, estimate
from freeswing.ident.drive.run_problem import head_of
from freeswing.ident.drive.unknowns import Asked

FIRST_HEAD_S = 0.15  # of a run: a cable's swings turn by less than ten radians
HEAD_STEPS = 8
JUMP = "encoder_jump.after_s"


def identify_with_effects(session: DriveSession, progress: Progress) -> DriveIdentification:
    """The joint estimate of what the file asks for and of the effects' numbers.

    The file's numbers come first, without the effects; where those start is then told by what the
    residuals show (a step of an encoder) or by masses tried (a weight). The rest starts where the
    session puts it.

    Raises:
        ValueError: when the runs cannot be simulated from where a search begins.
    """
    model, asked, runs = session.model, session.asked, session.of("identify")
    published, kinematics = step_1(session)
    theta, offsets = geometry(session, kinematics)
    progress("inverse dynamics", 0.05)
    regression = _regressed(session, theta, offsets)
    if regression is not None:
        dynamic = asked.without_effects.dynamic
        plain = replace(session, asked=asked.without_effects)
        theta = dynamic.put(model, theta, possible(plain, regression))
    free = session.zero_pose is None
    given = Premise(
        model, theta, runs, session.noise, session.zero_pose, offsets, session.static, free
    )
    progress("without the effects", 0.1)
    first = estimate(given, asked.without_effects, MOST_STEPS)
    progress("joint estimate", 0.4)
    started = _started(session, given, first)
    if _swings(session):
        started = _followed(started, asked, progress)
    joint = estimate(started, asked)
    progress("a second start", 0.65)
    apart = _second_start(started, joint)
    progress("predictions", 0.9)
    zero = offsets_of(session, model.declared, offsets)
    return DriveIdentification(
        published,
        kinematics,
        regression,
        None,
        apart,
        joint,
        tuple(predict(session, run, joint.theta, joint.offsets) for run in session.runs),
        tuple(predicted_as_declared(session, run, zero) for run in session.runs),
    )


def _regressed(session: DriveSession, theta, offsets) -> Regression | None:
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
    asked = {_of(name) for name in session.asked.added}
    known = driven_catalogue()
    return any(type(known[name]).stretch is not Effect.stretch for name in asked)


def _followed(given: Premise, asked: Asked, progress: Progress) -> Premise:
    """The start that longer and longer heads of the runs lead to.

    A cable's own swings tell its stiffness, and of a whole run only within a radian at its end:
    from farther off the search ends in another minimum, where they are a turn apart.
    """
    longest = max(len(run.record.times_s) / run.rate_hz for run in given.runs)
    seconds = FIRST_HEAD_S
    while seconds < longest:
        progress(f"elastic cables, the first {seconds:g} s", 0.4)
        heads = tuple(head_of(run, seconds) for run in given.runs)
        found = estimate(replace(given, runs=heads), asked, HEAD_STEPS)
        given = replace(given, theta=found.theta, offsets=found.offsets)
        seconds *= 2.0
    return given


def _untouched(session: DriveSession, name: str) -> bool:
    """Whether a number starts where the effect itself says."""
    model = session.model
    place = model.index(name)
    return model.declared[place] == model.parameters[place - len(model.numbers.names)].start


def _second_start(given: Premise, first: Estimate) -> float:
    """Largest difference of the minimum that is reached from numbers 5 % off."""
    asked: Asked = first.asked
    signs = np.where(np.arange(len(first.values)) % 2 == 0, SECOND_START, 1.0 / SECOND_START)
    signs[: asked.n_kinematic] = 1.0  # lengths 5 % off fit no pose
    away = asked.put(given.model, first.theta, first.values * signs)
    other = estimate(replace(given, theta=away, offsets=first.offsets), asked)
    gaps = np.abs(other.values - first.values)[first.determined]
    return float((gaps / first.std[first.determined]).max(initial=0.0))
