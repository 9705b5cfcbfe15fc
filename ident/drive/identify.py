"""A driven session identified: kinematics, a start by inverse dynamics, output error, joint."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.system.progress import Progress
from freeswing.ident.drive.asked_session import DriveSession
from freeswing.ident.drive.inverse_dynamics import Regression, inverse_dynamics
from freeswing.ident.drive.joint import Estimate, Premise, carried_over, estimate
from freeswing.ident.drive.kinematics import (
    Kinematics,
    as_published,
    most_likely,
    zero_turns,
)
from freeswing.ident.drive.predicted_run import RunFit, predict
from freeswing.ident.drive.records.ramps import Ramp, ramps
from freeswing.ident.drive.records.slack import before_slack
from freeswing.ident.drive.run_problem import (
    DriveRun,
)
from freeswing.ident.drive.second_start import away
from freeswing.ident.drive.unknowns import NOTHING, Asked

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class DriveIdentification:
    """All estimates of a session.

    Attributes:
        published: (18), or None without static poses or kinematic unknowns.
        kinematics: the same with poses as the noisy side.
        regression: inverse dynamics; None where angles fit no pose of the declared geometry.
        output_error: second step of two, its covariance with that of the kinematics; None with
            effects asked for on top, of which the first step knows nothing.
        second_start: largest difference of its end from another start, in deviations; of the
            joint estimate's where there is no output error.
        joint: the joint estimate.
        used: the runs that the joint estimate was fitted to, each up to its first slack cable.
        fits: every run by the joint estimate.
        initial: every run by the declared numbers.
        ramps: what each slow ramp says of its motor's friction beside the joint estimate.
    """

    published: Kinematics | None
    kinematics: Kinematics | None
    regression: Regression | None
    output_error: Estimate | None
    second_start: float
    joint: Estimate
    used: tuple[DriveRun, ...]
    fits: tuple[RunFit, ...]
    initial: tuple[RunFit | None, ...]
    ramps: tuple[Ramp, ...]


def identify_drive(session: DriveSession, progress: Progress) -> DriveIdentification:
    """Estimate what the session asks for.

    Raises:
        ValueError: when the angles fit no pose or a run cannot be simulated.
    """
    model, asked = session.model, session.asked
    published, kinematics = step_1(session)
    theta, offsets = geometry(session, kinematics)
    runs = session.of("identify")
    progress("inverse dynamics", 0.05)
    regression = inverse_dynamics(model, theta, asked.dynamic, list(runs), offsets)
    start = asked.dynamic.put(model, theta, possible(session, regression))
    given = Premise(
        model,
        start,
        before_slack(model, start, runs, offsets, at_least=True),
        session.noise,
        session.zero_pose,
        offsets,
    )
    progress("output error", 0.1)
    second = estimate(given, asked.dynamic)
    progress("a second start", 0.35)
    elsewhere = _second_start(given, asked, second)
    if kinematics is not None:
        kept = np.where(np.isfinite(kinematics.covariance), kinematics.covariance, 0.0)
        more = carried_over(given, asked, second, kept)
        second = replace(second, covariance=second.covariance + more)
    progress("joint estimate", 0.55)
    whole = premise_of(session, second.theta, offsets)
    joint, used = clear_of_slack(session, whole, estimate(whole, asked), estimate)
    progress("predictions", 0.9)
    return DriveIdentification(
        published,
        kinematics,
        regression,
        second,
        elsewhere,
        joint,
        used,
        predictions(session, joint),
        as_declared(session, offsets),
        ramps_of(session, joint),
    )


def premise_of(session: DriveSession, theta: Array, offsets: Array) -> Premise:
    """What a joint estimate from these numbers takes as given: static poses too, and the runs.

    Those end where a cable would first have to push by the numbers, but for their first half
    second.

    Raises:
        ValueError: when a run cannot be simulated.
    """
    model, free = session.model, session.zero_pose is None
    runs = before_slack(model, theta, session.of("identify"), offsets, at_least=True)
    return Premise(
        model, theta, runs, session.noise, session.zero_pose, offsets, session.static, free
    )


def clear_of_slack(
    session: DriveSession,
    given: Premise,
    found: Estimate,
    search: Callable[[Premise, Asked], Estimate],
) -> tuple[Estimate, tuple[DriveRun, ...]]:
    """The estimate, and the runs that it was fitted to: again where those held slack samples.

    Raises:
        ValueError: when a cable is slack almost from the start of a run on.
    """
    whole = session.of("identify")
    runs = before_slack(session.model, found.theta, whole, found.offsets)
    pairs = zip(runs, given.runs, strict=True)
    if all(len(now.record.times_s) >= len(then.record.times_s) for now, then in pairs):
        return found, given.runs
    given = replace(given, theta=found.theta, offsets=found.offsets, runs=runs)
    return search(given, found.asked), runs


def predictions(session: DriveSession, found: Estimate) -> tuple[RunFit, ...]:
    """Every run by an estimate."""
    return tuple(predict(session, run, found.theta, found.offsets) for run in session.runs)


def ramps_of(session: DriveSession, found: Estimate) -> tuple[Ramp, ...]:
    """The ramps among the recordings beside an estimate."""
    return ramps(session.model, found.theta, found.offsets, session.noise, session.runs)


def as_declared(session: DriveSession, offsets: Array) -> tuple[RunFit | None, ...]:
    """Every run by the declared numbers; None where they cannot follow it at all."""
    zero = offsets_of(session, session.model.declared, offsets)
    return tuple(_declared_fit(session, run, zero) for run in session.runs)


def apart(first: Estimate, other: Estimate) -> float:
    """Largest difference of two ends of a search, in the first one's deviations."""
    gaps = np.abs(other.values - first.values)[first.determined]
    return float((gaps / first.std[first.determined]).max(initial=0.0))


def step_1(session: DriveSession) -> tuple[Kinematics | None, Kinematics | None]:
    """Kinematics by (18) and by likelihood, None without static poses or kinematic unknowns."""
    wanted = session.asked.kinematic
    if session.static is None or not wanted.groups:
        return None, None
    args = (session.model, session.model.declared, wanted, session.static, session.zero_pose)
    return as_published(*args), most_likely(*args)


def geometry(session: DriveSession, found: Kinematics | None) -> tuple[Array, Array]:
    """Numbers with the estimated geometry, and L / r where the angles are zero."""
    model = session.model
    if found is not None:
        theta = session.asked.kinematic.put(model, model.declared, found.values)
        return theta, found.offsets_rad
    return model.declared, offsets_of(session, model.declared, None)


def offsets_of(session: DriveSession, theta: Array, fallback: Array | None) -> Array:
    """L / r where the angles are zero, (n,), at these numbers."""
    if session.zero_pose is not None:
        return zero_turns(session.model, theta, session.zero_pose, NOTHING)[0]
    if fallback is not None:
        return fallback
    raise ValueError(
        "encoder_zero is absent and there are no static poses to find it from: declare "
        "encoder_zero, or record static poses ([static])"
    )


def possible(session: DriveSession, regression: Regression) -> Array:
    """Regressed values, or the declared one where the regression gives an impossible one.

    Source:
        plain algebra: INCA 2016, eq. (9) has positive constants alone.
    """
    declared = session.asked.dynamic.read(session.model, session.model.declared)
    usable = np.isfinite(regression.values) & (regression.values * declared > 0.0)
    return np.where(usable, regression.values, declared)


def _second_start(given: Premise, asked: Asked, first: Estimate) -> float:
    """Largest difference of the minimum that is reached from numbers 5 % off."""
    theta = asked.dynamic.put(given.model, first.theta, away(first.values))
    return apart(first, estimate(replace(given, theta=theta), asked.dynamic))


def _declared_fit(session: DriveSession, run: DriveRun, zero: Array) -> RunFit | None:
    try:
        return predict(session, run, session.model.declared, zero)
    except ValueError:
        return None
