"""The linear screen: how much of the residual each candidate would explain, all at once."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel, build_driven
from freeswing.cdpr.driven.statics import CENTRE
from freeswing.ident.drive.diagnose.candidates import Candidate
from freeswing.ident.drive.joint import Estimate, Premise, Problem
from freeswing.ident.drive.run_problem import (
    Seen,
    gives_way,
    head_of,
    simulated,
    step_of,
)
from freeswing.ident.drive.unknowns import Asked, Group

Array = NDArray[np.float64]

# Of a column's own square: what is left of it beside all other unknowns must be more, or the
# recordings do not tell it from them in double precision.
LEAST_OWN = 1e-9


@dataclass(frozen=True, slots=True)
class Screened:
    """What the screen says of one candidate.

    Attributes:
        candidate: which.
        gain: by how much the sum of squared residuals over their variances falls.
        values: of its screened numbers, (k,).
        seen: whether the recordings tell it from the other unknowns at all.
        why: the runs cannot be simulated with it; empty where they can.
    """

    candidate: Candidate
    gain: float
    values: Array
    seen: bool
    why: str = ""


@dataclass(frozen=True, slots=True)
class Grown:
    """A model with more effects, and what it takes as given.

    Attributes:
        model: the larger model.
        theta: the smaller one's numbers in it.
    """

    model: DrivenModel
    theta: Array


def grown(model: DrivenModel, theta: Array, effects: tuple[str, ...]) -> Grown:
    """The model with more effects at their start values."""
    more = tuple(name for name in effects if name not in model.effects)
    larger = build_driven(model.robot, (*model.effects, *more))
    whole = larger.declared.copy()
    whole[: len(theta)] = theta
    return Grown(larger, whole)


def screen(
    given: Premise, found: Estimate, chosen: tuple[Candidate, ...], starts: dict[str, float]
) -> tuple[Screened, ...]:
    """Every candidate's gain about an estimate, its other unknowns free to move.

    Args:
        given: the estimate's premise.
        found: the estimate.
        chosen: the candidates.
        starts: values of shape parameters, by their full names.
    """
    effects = tuple(dict.fromkeys(candidate.effect for candidate in chosen))
    larger = grown(given.model, found.theta, effects)
    for name, value in starts.items():
        if name in larger.model.names:
            larger.theta[larger.model.index(name)] = value
    refused = {one.label: _refusal(given, larger, one) for one in chosen}
    followed = [one for one in chosen if not refused[one.label]]
    columns = tuple(dict.fromkeys(name for one in followed for name in one.screened))
    n_base = len(found.asked.groups)
    more = tuple(Group(name, (name,)) for name in columns)
    asked = Asked((*found.asked.groups, *more), found.asked.n_kinematic)
    premise = replace(given, model=larger.model, theta=larger.theta)
    problem = Problem(premise, asked)
    x = problem.start()
    rest = found.found.values[n_base:]
    x[problem.k :] = rest
    normal = problem.normal(x)
    own = np.arange(n_base, problem.k)
    base = np.setdiff1d(np.arange(problem.size), own)
    left, slope = _beside(normal.matrix, normal.gradient, base, own)
    places = {name: k for k, name in enumerate(columns)}
    squares = np.diag(normal.matrix)[own]
    return tuple(
        Screened(one, 0.0, np.zeros(len(one.screened)), False, refused[one.label])
        if refused[one.label]
        else _judged(one, places, left, slope, squares)
        for one in chosen
    )


def _refusal(given: Premise, larger: Grown, candidate: Candidate) -> str:
    """Why not even the first samples can be simulated with a candidate's numbers, or nothing.

    Cables of the stiffness at which its slopes are differences may swing too fast for any step.
    """
    model = larger.model
    for name in candidate.screened:
        if not gives_way(model, name):
            continue
        theta = larger.theta.copy()
        theta[model.index(name)] += step_of(model, larger.theta, name)
        for run in given.runs:
            first = head_of(run, 0.0)
            seen = first.record.poses[first.record.seen]
            try:
                simulated(model, theta, first, seen[0] if len(seen) else CENTRE)
            except ValueError as error:
                return str(error)
    return ""


def _beside(
    matrix: Array, gradient: Array, base: NDArray[np.intp], own: NDArray[np.intp]
) -> tuple[Array, Array]:
    """Normal equations of `own` with the unknowns of `base` eliminated."""
    block = matrix[np.ix_(base, base)]
    size = np.sqrt(np.maximum(np.diag(block), 1e-300))
    unit = block / np.outer(size, size)
    values, vectors = np.linalg.eigh(unit)
    kept = values > 1e-13 * values[-1]
    inverse = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T / np.outer(size, size)
    across = matrix[np.ix_(base, own)]
    solved = inverse @ np.column_stack([across, gradient[base]])
    left = matrix[np.ix_(own, own)] - across.T @ solved[:, :-1]
    return left, gradient[own] - across.T @ solved[:, -1]


def _judged(
    candidate: Candidate, places: dict[str, int], left: Array, slope: Array, squares: Array
) -> Screened:
    at = np.array([places[name] for name in candidate.screened], dtype=np.intp)
    if len(at) == 0:
        return Screened(candidate, 0.0, np.zeros(0), False)
    size = np.sqrt(np.maximum(squares[at], 1e-300))
    unit, b = left[np.ix_(at, at)] / np.outer(size, size), slope[at] / size
    values, vectors = np.linalg.eigh(unit)
    kept = values > LEAST_OWN
    if not kept.any():
        return Screened(candidate, 0.0, np.zeros(len(at)), False)
    along = vectors[:, kept].T @ b
    gain = float(np.sum(along**2 / values[kept]))
    estimate = -(vectors[:, kept] @ (along / values[kept])) / size
    return Screened(candidate, gain, estimate, True)


def jump_start(seen: list[Seen], names: tuple[str, ...]) -> dict[str, float]:
    """When an encoder lost counts, by the largest step in any motor's residual."""
    best, when = 0.0, 0.0
    for one in seen:
        gaps = one.angles - one.angles.mean(axis=0)
        n = len(gaps)
        sums = np.cumsum(gaps, axis=0)[:-1]
        counts = np.arange(1, n)[:, None]
        scores = np.abs(sums) / np.sqrt(counts * (n - counts) / n)
        row = int(np.argmax(scores.max(axis=1)))
        if scores[row].max() > best:
            best, when = float(scores[row].max()), float(one.motion.times_s[row + 1])
    return {name: when for name in names}
