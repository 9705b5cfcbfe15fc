"""The maximum-likelihood estimates of a session: full poses, and free coordinates alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.cdpr.system.progress import Progress
from freeswing.ident.estimate import Estimate
from freeswing.ident.fidim.essential_parameters import undetermined
from freeswing.ident.judge.free_swing_law import unexplained_motion
from freeswing.ident.judge.physical_consistency import consistency, is_possible, nearest_possible
from freeswing.ident.likelihood.between_runs import widened
from freeswing.ident.likelihood.blocks import INERTIA, MODES, PAYLOADS, first_unknowns
from freeswing.ident.likelihood.cable_ends import geometry_document, weighed_against_priors
from freeswing.ident.likelihood.calibration_modes import (
    modes_document,
    modes_notes,
    with_calibration,
)
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_swings import FreeSwing, LikelihoodFit, Swings
from freeswing.ident.likelihood.guess_run_start import first_state
from freeswing.ident.likelihood.payload_runs import Loads, mass_of
from freeswing.ident.likelihood.run_residuals import Samples
from freeswing.ident.likelihood.samples_and_noise import prepare
from freeswing.ident.runs import DroppedRun
from freeswing.ident.signals.usable_runs import PreparedRun

_ASTRAY = 0.5  # a lost swing is out of phase with its samples


@dataclass(frozen=True, slots=True)
class Asked:
    """What a maximum-likelihood estimate is asked for beside the fit itself.

    Attributes:
        consistent: hold the inertia to what a body can have.
        mass_kg: a guess of the mass, to start from where runs carry payloads.
    """

    consistent: bool = False
    mass_kg: float | None = None


def ml_estimate(
    model: Model,
    runs: list[PreparedRun],
    free: tuple[str, ...] | None,
    inertia: Array,
    dropped: tuple[DroppedRun, ...] = (),
    progress: Progress | None = None,
    asked: Asked | None = None,
) -> tuple[Estimate, LikelihoodFit]:
    """Fit the free motions themselves to the samples of some runs.

    Args:
        model: the robot; values of its effects, if any, are estimated with their priors.
        runs: those to fit, with and without payloads.
        free: the coordinates to use of them, or None for full poses.
        inertia: where to start, (9,): FIDIM's result.
        dropped: runs left out, for the record.
        progress: told a label and a fraction.
        asked: what else is asked for.

    Raises:
        ValueError: when no run's samples can give a motion, or the fit breaks down.
    """
    asked = asked or Asked()
    _, samples, states, more = begun(model, runs, free, inertia, asked.mass_kg)
    payloads = [run.payload for run in samples]
    unknowns = first_unknowns(model, inertia, states, payloads, mass_kg=asked.mass_kg)
    swings = Swings(model, tuple(samples), np.ones(2))
    found, cost = fit(swings, unknowns, FreeSwing(progress=progress)), None
    if asked.consistent and not is_possible(found.inertia):
        held = _held(found, progress)
        found, cost = held, held.deviance - found.deviance
    if not any(
        run.errors for run in samples
    ):  # which are weighed against coloured residuals by themselves
        found = weighed_against_priors(found, consistent=cost is not None)
    told = with_calibration(found, consistent=cost is not None)
    entry = _entry(told, dropped + more, cost)
    return replace(
        entry,
        notes=entry.notes + modes_notes(told),
        calibration=told.value(MODES) if MODES in told.unknowns else np.zeros(0),
        extra={**entry.extra, **modes_document(told)},
    ), told


def from_starts(
    model: Model,
    runs: list[PreparedRun],
    free: tuple[str, ...] | None,
    starts: list[Array],
    dropped: tuple[DroppedRun, ...],
    progress: Progress | None,
    asked: Asked | None,
) -> tuple[Estimate, LikelihoodFit]:
    """The first fit from several starts that follows the runs, or else the likeliest of all.

    A fit follows when its residuals are small beside the swings and no body is ruled out by it.

    Raises:
        ValueError: when no start leads to a fit: what went wrong from the first.
    """
    found: list[tuple[Estimate, LikelihoodFit]] = []
    failure: Exception | None = None
    for start in starts:
        try:
            entry, result = ml_estimate(model, runs, free, start, dropped, progress, asked)
        except (ValueError, np.linalg.LinAlgError) as error:
            failure = failure or error
            continue
        if not is_refuted(entry, result) and astray(result) < _ASTRAY:
            return entry, result
        found.append((entry, result))
    if not found:
        raise ValueError(str(failure)) from failure
    return min(found, key=lambda pair: pair[1].deviance)


def is_refuted(entry: Estimate, found: LikelihoodFit) -> bool:
    """Whether no body has the inertia that a fit needs, by the fit's own deviations.

    A run that follows no law puts the runs apart: the deviations between them would excuse it.
    """
    own = found.covariance_of(INERTIA)
    return consistency(found.inertia, own, entry.held_cost).is_refuted


def astray(found: LikelihoodFit) -> float:
    """Largest share of a run's motion that its fit leaves unexplained, root mean square."""
    return float(unexplained_motion(found).max())


def begun(
    model: Model,
    runs: list[PreparedRun],
    free: tuple[str, ...] | None,
    inertia: Array,
    mass_kg: float | None = None,
) -> tuple[list[PreparedRun], list[Samples], Array, tuple[DroppedRun, ...]]:
    """Runs that can be started, their samples and first states, and the others with reasons.

    Args:
        model: the robot.
        runs: with and without payloads.
        free: the coordinates to use of them, or None for full poses.
        inertia: where to start, (9,).
        mass_kg: a guess of the mass, where runs carry payloads.

    Raises:
        ValueError: when no run without payload can be started.
    """
    kept, samples, states, dropped = [], [], [], []
    for run in runs:
        load = Loads.of([run.run.payload])
        guess = load.inertia(0, inertia, load.start(mass_kg))
        try:
            one, state = started(model, run, free, guess)
        except (ValueError, np.linalg.LinAlgError) as error:
            dropped.append(DroppedRun(run.name, str(error)))
            continue
        kept.append(run)
        samples.append(one)
        states.append(state)
    if not any(run.run.payload is None for run in kept):
        raise ValueError(
            f"no run without payload can be started; {dropped[0].run}: {dropped[0].why}"
            if dropped
            else "no run without payload"
        )
    return kept, samples, np.array(states), tuple(dropped)


def _held(found: LikelihoodFit, progress: Progress | None) -> LikelihoodFit:
    """The fit again, its inertia held to what a body can have."""
    if found.rank < int(found.free.sum()):
        return found
    inertia = nearest_possible(found.inertia, found.covariance_of(INERTIA))
    start = found.unknowns.moved({INERTIA: inertia})
    return fit(found.swings, start, FreeSwing(consistent=True, progress=progress))


def started(
    model: Model, run: PreparedRun, free: tuple[str, ...] | None, inertia: Array
) -> tuple[Samples, Array]:
    """A run's samples and a first state [zeta; rates], (12,).

    Free coordinates alone come with cable lengths: the stated ones, or those of the run's poses.

    Raises:
        ValueError: when the samples cannot give a state.
    """
    samples = sampled(run, free)
    return samples, first_state(model, samples, inertia)


def sampled(run: PreparedRun, free: tuple[str, ...] | None) -> Samples:
    """A run's samples; free coordinates alone come with cable lengths.

    Raises:
        ValueError: when too few are known.
    """
    seen = run.run
    if free is not None:
        trajectory = seen.trajectory.select(free)
        seen = replace(seen, trajectory=trajectory, lengths_m=run.lengths_m)
    return prepare(seen, run.signals.window_s)


def _entry(
    found: LikelihoodFit, dropped: tuple[DroppedRun, ...], held_cost: float | None
) -> Estimate:
    own = found.covariance_of(INERTIA)
    between = found.between[found.place(INERTIA)]
    covariance = widened(own, between, len(found.samples))
    if not np.isfinite(covariance).all():
        raise ValueError(
            f"the samples do not determine the inertia: rank {found.rank} of "
            f"{int(found.free.sum())}; record larger swings in all modes about more equilibria"
        )
    std = np.sqrt(np.diag(covariance))
    notes = []
    if found.enlargement > 1.0:
        notes.append(
            f"the residuals are not white (power below 5 Hz is {found.correlation:.3g} times that "
            "of white noise): the model misses something; standard deviations are enlarged for it, "
            "and for what it moves in all runs alike as far as the residuals tell (`freeswing "
            "diagnose` asks what it is)"
        )
    wider = np.sqrt(np.diag(covariance) / np.diag(own)).max()
    if wider > 1.0:
        notes.append(
            f"runs say apart up to {wider:.1f} times what their residuals let expect: standard "
            "deviations are those of leaving out one run at a time"
        )
    mass = None
    if PAYLOADS in found.unknowns:
        try:
            mass = mass_of(found.value(PAYLOADS)[0], float(found.std(PAYLOADS)[0]))
        except ValueError as error:
            notes.append(str(error))
    if said := consistency(found.inertia, covariance, held_cost).sentence():
        notes.append(said)
    noise = {"noise_m": found.noise[0], "noise_rad": found.noise[1]}
    return Estimate(
        values=found.inertia,
        covariance=covariance,
        essential=~undetermined(found.inertia, std),
        samples=sum(len(run.times_s) for run in found.samples),
        dropped=dropped,
        notes=tuple(notes),
        mass=mass,
        held_cost=held_cost,
        extra={
            **{key: float(value) for key, value in noise.items() if np.isfinite(value)},
            "stop_reason": found.reason,
            **geometry_document(found),
        },
    )
