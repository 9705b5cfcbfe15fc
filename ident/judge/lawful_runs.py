"""The maximum-likelihood estimate without the runs that follow no free swing.

A fit of all runs cannot say who is lawless: one bad run may lead it to where a good one is followed
least. Runs are therefore left out by it, and judged again by the inertia that the others give.
"""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array
from freeswing.cdpr.system.progress import Progress
from freeswing.ident.estimate import Estimate
from freeswing.ident.judge.free_swing_law import (
    LawlessError,
    is_lawless,
    lawless_sentence,
    unexplained_motion,
)
from freeswing.ident.judge.prediction import predict
from freeswing.ident.likelihood.fit_swings import LikelihoodFit
from freeswing.ident.likelihood.session_estimates import Asked, from_starts, is_refuted
from freeswing.ident.runs import DroppedRun
from freeswing.ident.signals.usable_runs import PreparedRun

# Times the worst run: one bad run may take others with it, which leave together.
AS_BAD = 0.95


def best_ml_estimate(
    model: Model,
    runs: list[PreparedRun],
    free: tuple[str, ...] | None,
    starts: list[Array],
    dropped: tuple[DroppedRun, ...] = (),
    progress: Progress | None = None,
    asked: Asked | None = None,
) -> tuple[Estimate, LikelihoodFit]:
    """The likeliest fit, without the runs that follow no free swing: they are dropped by name.

    Runs that a fit of all explains worst leave first, until it explains the others. Of those that
    left, the ones that the inertia of the others explains come back.

    Args:
        model: the robot; values of its effects, if any, are estimated with their priors.
        runs: those to fit, with and without payloads.
        free: the coordinates to use of them, or None for full poses.
        starts: inertias to start from, (9,) each.
        dropped: runs left out before, for the record.
        progress: told a label and a fraction.
        asked: what else is asked for.

    Raises:
        LawlessError: when no run follows one.
        ValueError: when no start leads to a fit: what went wrong from the first.
    """
    left: dict[str, DroppedRun] = {}

    def fitted(first: list[Array]) -> tuple[Estimate, LikelihoodFit]:
        kept = [run for run in runs if run.name not in left]
        return from_starts(model, kept, free, first, (*dropped, *left.values()), progress, asked)

    entry, found = fitted(starts)
    while worst := _lawless(entry, found):
        left |= worst
        starts = [entry.values, *starts]
        entry, found = fitted(starts)
    back = [run.name for run in runs if run.name in left and _obeys(model, run, free, entry.values)]
    if not back:
        return entry, found
    left = {name: drop for name, drop in left.items() if name not in back}
    again = fitted([entry.values])
    return (entry, found) if _which(*again).any() else again


def _which(entry: Estimate, found: LikelihoodFit) -> np.ndarray:
    return is_lawless(unexplained_motion(found), refuted=is_refuted(entry, found))


def _lawless(entry: Estimate, found: LikelihoodFit) -> dict[str, DroppedRun]:
    """The runs that a fit explains too little of and least of all, by name.

    Raises:
        LawlessError: when it explains too little of every run.
    """
    shares, lawless = unexplained_motion(found), _which(entry, found)
    if lawless.all():
        least = int(np.argmin(shares))
        raise LawlessError(
            "no run swings freely by this robot's equations; of "
            f"{found.samples[least].name}, which comes closest, "
            f"{lawless_sentence(float(shares[least]))}"
        )
    worst = np.flatnonzero(lawless & (shares > AS_BAD * shares.max()))
    named = ((found.samples[k].name, lawless_sentence(float(shares[k]))) for k in worst)
    return {name: DroppedRun(name, why, lawless=True) for name, why in named}


def _obeys(model: Model, run: PreparedRun, free: tuple[str, ...] | None, inertia: Array) -> bool:
    """Whether the inertia that other runs gave explains a run, whose start alone is fitted."""
    try:
        told = predict(model, run, free, inertia)
    except (ValueError, np.linalg.LinAlgError):
        return False
    spread = told.measured - told.measured.mean(axis=0)
    share = np.sqrt(np.sum((told.measured - told.predicted) ** 2) / np.sum(spread**2))
    return not is_lawless(np.array([share])).any()
