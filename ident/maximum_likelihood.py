"""The maximum-likelihood estimates of a session: full poses, and free coordinates alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdpr.model import Model
from cdpr.robot import Array
from ident.estimate import Estimate
from ident.fidim import WELL_IDENTIFIED_PERCENT, near_zero
from ident.guess import first_state
from ident.joint import State
from ident.likelihood import LikelihoodFit, fit
from ident.likelihood_run import Samples, predicted
from ident.prepare import PreparedRun, Progress
from ident.runs import DroppedRun
from ident.samples import prepare
from ident.starts import is_possible

_ASTRAY = 0.5  # a lost swing is out of phase with its samples


def ml_estimate(
    model: Model,
    runs: list[PreparedRun],
    free: tuple[str, ...] | None,
    inertia: Array,
    dropped: tuple[DroppedRun, ...] = (),
    progress: Progress | None = None,
) -> tuple[Estimate, LikelihoodFit]:
    """Fit the free motions themselves to the samples of some runs.

    Args:
        model: the robot.
        runs: those to fit.
        free: the coordinates to use of them, or None for full poses.
        inertia: where to start, (9,): FIDIM's result.
        dropped: runs left out, for the record.
        progress: told a label and a fraction.

    Raises:
        ValueError: when a run's samples cannot give a motion, or the fit breaks down.
    """
    starts = [started(model, run, free, inertia) for run in runs]
    samples = [one for one, _ in starts]
    states = np.array([state for _, state in starts])
    state = State(np.array(inertia), model.start_values, states, np.ones(2))
    found = fit(model, samples, state, progress=progress)
    return _entry(found, dropped), found


def best_ml_estimate(
    model: Model,
    runs: list[PreparedRun],
    free: tuple[str, ...] | None,
    starts: list[Array],
    dropped: tuple[DroppedRun, ...] = (),
    progress: Progress | None = None,
) -> Estimate:
    """The first fit from several starts that follows the runs, or else the likeliest of all.

    A fit follows when its residuals are small beside the swings and a body can have its inertia.

    Raises:
        ValueError: when no start leads to a fit: what went wrong from the first.
    """
    found: list[tuple[float, Estimate]] = []
    failure: Exception | None = None
    for start in starts:
        try:
            entry, result = ml_estimate(model, runs, free, start, dropped, progress)
        except (ValueError, np.linalg.LinAlgError) as error:
            failure = failure or error
            continue
        if is_possible(entry.values) and _astray(result) < _ASTRAY:
            return entry
        found.append((result.deviance, entry))
    if not found:
        raise ValueError(str(failure)) from failure
    return min(found, key=lambda pair: pair[0])[1]


def _astray(found: LikelihoodFit) -> float:
    """Largest share of a run's motion that its fit leaves unexplained, root mean square."""
    shares = []
    for motion, samples in zip(found.motions, found.samples, strict=True):
        off = samples.values - predicted(motion, samples.times_s)[:, samples.columns]
        spread = samples.values - samples.values.mean(axis=0)
        shares.append(float(np.sqrt(np.sum(off**2) / np.sum(spread**2))))
    return max(shares)


def started(
    model: Model, run: PreparedRun, free: tuple[str, ...] | None, inertia: Array
) -> tuple[Samples, Array]:
    """A run's samples and a first state [zeta; rates], (12,).

    Free coordinates alone come with cable lengths: the stated ones, or those of the run's poses.

    Raises:
        ValueError: when the samples cannot give a state.
    """
    seen = run.run
    if free is not None:
        trajectory = seen.trajectory.select(free)
        seen = replace(seen, trajectory=trajectory, lengths_m=run.lengths_m)
    samples = prepare(seen, run.signals.window_s)
    return samples, first_state(model, samples, inertia)


def _entry(found: LikelihoodFit, dropped: tuple[DroppedRun, ...]) -> Estimate:
    covariance = found.covariance[:9, :9]
    if not np.isfinite(covariance).all():
        raise ValueError(
            f"the samples do not determine the inertia: rank {found.rank} of "
            f"{int(found.free.sum())}; record larger swings in all modes about more equilibria"
        )
    std = np.sqrt(np.diag(covariance))
    weak = 100.0 * std > WELL_IDENTIFIED_PERCENT * np.abs(found.inertia)
    notes = []
    if found.correlation > 1.2:
        notes.append(
            f"the residuals are not white (power below 5 Hz is {found.correlation:.3g} times that "
            "of white noise): the model misses something; standard deviations are enlarged for it"
        )
    noise = {"noise_m": found.noise[0], "noise_rad": found.noise[1]}
    return Estimate(
        values=found.inertia,
        covariance=covariance,
        essential=~(weak & near_zero(found.inertia)),
        samples=sum(len(run.times_s) for run in found.samples),
        dropped=dropped,
        notes=tuple(notes),
        extra={
            **{key: float(value) for key, value in noise.items() if np.isfinite(value)},
            "stop_reason": found.reason,
        },
    )
