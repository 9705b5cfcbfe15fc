"""A candidate fitted with everything else, and what runs that were never fitted say of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.ident.drive.asked_session import DriveSession
from freeswing.ident.drive.diagnose.candidates import CENTRE, Candidate
from freeswing.ident.drive.diagnose.screen import Screened, grown
from freeswing.ident.drive.elastic_search import best_start, followed, known_at_rest, stretches
from freeswing.ident.drive.identify import possible
from freeswing.ident.drive.inverse_dynamics import inverse_dynamics
from freeswing.ident.drive.joint import Estimate, Premise, Problem, estimate
from freeswing.ident.drive.predicted_run import HEAD_S, RunFit, predict
from freeswing.ident.drive.solver import MISFIT
from freeswing.ident.drive.unknowns import Asked, Group

Array = NDArray[np.float64]

# What is missing leaves a sum of squares that no search brings down: more steps do not help.
MOST_STEPS = 14
ROUGH = 1e-3  # of its cost: a step that gains less ends a search far above the noise
LOST = 10.0  # mean square over the noise of a run's first part that a cause does not leave
MORE_STEPS = 40  # for the one that is best: a cause that was found ends at the noise
WEIGHTS_KG = (0.02, 0.05, 0.1, 0.2)  # tried for an undeclared weight whose moment is known


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Runs that were not fitted, predicted from their starts.

    Attributes:
        fits: of the runs.
        rms_rad: of all motor angles.
        times_noise: that over what encoder counts leave.
        poses_m: rms of the measured positions' differences.
        poses_rad: of the measured orientations'.
    """

    fits: tuple[RunFit, ...]
    rms_rad: float
    times_noise: float
    poses_m: float
    poses_rad: float


@dataclass(frozen=True, slots=True)
class Fitted:
    """A model fitted to the runs to identify from.

    Attributes:
        candidate: what it has more than the one before, or None.
        given: its premise.
        found: the estimate.
        held_out: how it predicts; None where it cannot follow the runs at all.
    """

    candidate: Candidate | None
    given: Premise
    found: Estimate
    held_out: HeldOut | None

    @property
    def chi_square(self) -> float:
        """Sum of squared residuals over their variances."""
        return 2.0 * self.found.found.normal.cost

    @property
    def n(self) -> int:
        """Number of residuals."""
        return self.found.found.normal.n

    @property
    def times_noise(self) -> float:
        """Of the held-out runs; infinite where they cannot be followed."""
        return np.inf if self.held_out is None else self.held_out.times_noise

    def bic_beside(self, other: Fitted) -> float:
        """BIC less that of a smaller model, the residuals' scale unknown."""
        more = len(self.found.asked.groups) - len(other.found.asked.groups)
        worse = np.log(self.chi_square / other.chi_square)
        return float(self.n * worse + more * np.log(self.n))


def fitted(session: DriveSession, given: Premise, asked: Asked, candidate=None) -> Fitted:
    """Fit, then predict the runs kept apart."""
    found = estimate(given, asked, MOST_STEPS, ROUGH)
    return Fitted(candidate, given, found, _held_out(session, given.model, found))


def refitted(session: DriveSession, fit: Fitted) -> Fitted:
    """The same with the runs that the session has now: all again where one has become shorter."""
    runs = session.of("identify")
    if all(a is b for a, b in zip(runs, fit.given.runs, strict=True)):
        held_out = _held_out(session, fit.given.model, fit.found)
        return replace(fit, held_out=held_out)
    found = fit.found
    given = replace(fit.given, runs=runs, theta=found.theta, offsets=found.offsets)
    return fitted(session, given, found.asked, fit.candidate)


def _held_out(session: DriveSession, model: DrivenModel, found: Estimate) -> HeldOut | None:
    session, noise = replace(session, model=model), session.noise
    try:
        fits = tuple(
            predict(session, run, found.theta, found.offsets) for run in session.of("validate")
        )
    except ValueError:
        return None
    rms = float(np.sqrt(np.mean([np.mean(fit.gaps_rad**2) for fit in fits])))
    gaps = np.concatenate([fit.pose_gaps for fit in fits])
    return HeldOut(
        fits,
        rms,
        rms / noise.angle_std_rad,
        float(np.sqrt(np.mean(gaps[:, :3] ** 2))) if len(gaps) else np.nan,
        float(np.sqrt(np.mean(gaps[:, 3:] ** 2))) if len(gaps) else np.nan,
    )


def settled(session: DriveSession, fit: Fitted) -> Fitted:
    """The same fit, gone on with to its end."""
    if fit.candidate is not None and stretches(fit.candidate.effect):
        return _followed(session, fit)
    found = fit.found
    given = replace(fit.given, theta=found.theta, offsets=found.offsets)
    again = estimate(given, found.asked, MORE_STEPS)
    return Fitted(fit.candidate, given, again, _held_out(session, given.model, again))


def _followed(session: DriveSession, fit: Fitted) -> Fitted:
    """Elastic cables fitted from static poses and the runs' heads on, where that is better.

    Static poses may ask for cables too stiff to be simulated: then the fit stays what it was.
    """
    try:
        again = _from_rest(fit.given, fit.found)
    except ValueError:
        return fit
    if again.found.normal.cost >= fit.found.found.normal.cost:
        return fit
    return Fitted(fit.candidate, fit.given, again, _held_out(session, fit.given.model, again))


def _from_rest(given: Premise, found: Estimate) -> Estimate:
    asked = found.asked
    declared = asked.put(given.model, found.theta, asked.read(given.model, given.model.declared))
    rest = known_at_rest(replace(given, theta=declared), asked)
    kinematic = asked.kinematic.read(given.model, rest.theta)
    fitted_theta = asked.kinematic.put(given.model, found.theta, kinematic)
    for name in asked.members:
        if stretches(name):
            fitted_theta[given.model.index(name)] = rest.theta[given.model.index(name)]
    started = best_start(rest, asked, (rest.theta, fitted_theta))
    return followed(started, asked)


def with_candidate(
    session: DriveSession, base: Fitted, screened: Screened, starts: dict[str, float]
) -> Fitted:
    """The base with one candidate more, begun where the screen puts it.

    Raises:
        ValueError: when the runs cannot be simulated from there.
    """
    candidate, found = screened.candidate, base.found
    larger = grown(base.given.model, found.theta, (candidate.effect,))
    model, theta = larger.model, larger.theta
    for name, value in starts.items():
        if name in model.names:
            theta[model.index(name)] = value
    asked = Asked((*found.asked.groups, *candidate.groups), found.asked.n_kinematic)
    given = replace(base.given, model=model, theta=theta, offsets=found.offsets)
    if candidate.screened[0] in CENTRE:
        return fitted(session, weighted(given, found, candidate.groups), asked, candidate)
    for name, value in zip(candidate.screened, screened.values, strict=True):
        limits = model.parameters[model.index(name) - len(model.numbers.names)]
        theta[model.index(name)] = np.clip(value, limits.low, limits.high)
    fit = fitted(session, given, asked, candidate)
    if fit.chi_square <= MISFIT * fit.n or stretches(candidate.effect):
        return fit
    start = grown(base.given.model, base.given.theta, (candidate.effect,)).theta
    places = [model.index(group.name) for group in candidate.groups]
    start[places] = theta[places]
    again = _from_poses(session, replace(given, theta=start), asked, candidate)
    if again is None or again.found.normal.cost >= fit.found.found.normal.cost:
        return fit
    return Fitted(candidate, given, again, _held_out(session, model, again))


def _from_poses(
    session: DriveSession, given: Premise, asked: Asked, candidate: Candidate
) -> Estimate | None:
    """The fit from what static poses tell with the candidate, and from the runs' heads on.

    Whole runs pull the geometry far off where something is missing: a drum that is 2 % wrong is
    not found again from there.
    """
    at_rest = Asked((*asked.kinematic.groups, *candidate.groups), asked.n_kinematic)
    model, plain = given.model, session.asked.dynamic
    try:
        if given.static is not None:
            found = estimate(replace(given, runs=()), at_rest, MOST_STEPS)
            given = replace(given, theta=found.theta, offsets=found.offsets)
        runs = list(given.runs)
        regression = inverse_dynamics(model, given.theta, plain, runs, given.offsets)
        values = possible(replace(session, model=model), regression)
        given = replace(given, theta=plain.put(model, given.theta, values))
        return followed(given, asked, HEAD_S, LOST)
    except ValueError:  # it does not lead anywhere: the first fit stands
        return None


def weighted(given: Premise, found: Estimate, groups: tuple[Group, ...]) -> Premise:
    """Where a weight's fit begins: the moment of a displaced centre, and the best of some masses.

    Products of inertia alone tell a light weight far out from a heavy one near the centre: from a
    wrong one the search goes astray.

    Args:
        given: the larger model's premise.
        found: the estimate without the weight.
        groups: the weight's mass and its three coordinates.
    """
    names = [name for name in CENTRE if name not in found.asked.members]
    asked = Asked(
        (*found.asked.groups, *(Group(name, (name,)) for name in names)), found.asked.n_kinematic
    )
    centred = estimate(given, asked, MOST_STEPS, ROUGH)
    model, best, theta = given.model, np.inf, given.theta
    mass = centred.theta[model.index("mass_kg")]
    places = [model.index(name) for name in CENTRE]
    moment = mass * (centred.theta[places] - given.theta[places])
    for weight in WEIGHTS_KG:
        trial = centred.theta.copy()
        trial[places] = given.theta[places]
        trial[model.index("mass_kg")] = mass - weight
        for group, value in zip(groups, (weight, *(moment / weight)), strict=True):
            limits = model.parameters[model.index(group.name) - len(model.numbers.names)]
            trial[model.index(group.name)] = np.clip(value, limits.low, limits.high)
        problem = Problem(replace(given, theta=trial), found.asked)
        try:
            cost = problem.normal(problem.start()).cost
        except ValueError:
            continue
        if cost < best:
            best, theta = cost, trial
    return replace(given, theta=theta)
