"""The best fit of a start pose: sought near the stated tensions, then over many."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeGuard

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import DataError
from freeswing.homing.arrow_least_squares import ArrowSolution
from freeswing.homing.fit_start_pose import LOSS_LIMIT, StartFit, StartProblem
from freeswing.homing.guess_from_tensions import TensionEnergy, free_indices
from freeswing.homing.homing_files import Homing, ReadingNoise
from freeswing.homing.many_starts import far_rows, many_starts, rank_starts
from freeswing.homing.misfit import is_good, is_near
from freeswing.homing.reading_mistakes import likely_mistake
from freeswing.homing.rest_readings import RestModel

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Judgement:
    """When a solution explains the readings.

    Attributes:
        loss_limit: of Huber's loss in the fit, standard deviations; begun where plain squares end,
            since its slopes are too flat to lead there from afar.
        share: of the static poses that must be explained; the worst others are left out.
    """

    loss_limit: float
    share: float

    def explains(
        self, solution: ArrowSolution | None, problem: StartProblem
    ) -> TypeGuard[ArrowSolution]:
        """Whether the squares of that share of the poses are what noise leaves."""
        if solution is None or not solution.converged:
            return False
        squares = np.sort((solution.linearization.residuals**2).sum(axis=1))
        kept = squares[: int(np.ceil(self.share * len(squares)))]
        return is_good(float(kept.sum()), problem.degrees)


PLAIN = Judgement(np.inf, 1.0)
ROBUST = Judgement(LOSS_LIMIT, 0.9)  # a mistyped row in ten is told as suspect, not as no start


def best_fit(
    problem: StartProblem, homing: Homing, guesses: list[Array], energy: TensionEnergy
) -> StartFit:
    """The fit of the guess that explains the readings best; the first good one ends the search.

    Raises:
        DataError: where none is found, with a mistake in the readings that would explain it.
    """
    best = _solve_from(problem, homing.noise, guesses, PLAIN)
    if PLAIN.explains(best, problem):
        return problem.finish(best, homing.noise)
    begun = [best.blocks] if best is not None and best.converged else []
    near = _solve_from(problem, homing.noise, begun, ROBUST)
    if ROBUST.explains(near, problem):
        return problem.finish(near, homing.noise)
    if near is not None and near.converged and is_near(2 * near.cost, problem.degrees):
        return problem.finish(near, homing.noise)
    starts = many_starts(energy, homing.robot.n_cables)
    wide = _solve_from(problem, homing.noise, guess_widely(homing, starts), ROBUST)
    if ROBUST.explains(wide, problem):
        return problem.finish(wide, homing.noise)
    suspect = likely_mistake(homing, lambda changed: _explained(changed, starts))
    if suspect or best is None:
        raise DataError(f"the readings come from no start pose{suspect and ', but do '}{suspect}")
    return problem.finish(best, homing.noise)


def guess_widely(homing: Homing, starts: Array) -> list[Array]:
    """Every pose as the best of many starts has it, (N, 6); nothing where none can be computed."""
    if not len(starts):
        return []
    model = model_for(homing, starts[0])
    few = replace(homing, readings=homing.readings.rows(far_rows(homing.readings)))
    problem = StartProblem(few, model, None)
    best = _solve_from(problem, homing.noise, rank_starts(problem, homing.noise, starts), ROBUST)
    if best is None:
        return []
    return rank_starts(StartProblem(homing, model, None), homing.noise, best.blocks[:1])


def _explained(homing: Homing, starts: Array) -> bool:
    """Whether these readings come from some start pose."""
    guesses = guess_widely(homing, starts)
    if not guesses:
        return False
    problem = StartProblem(homing, model_for(homing, guesses[0][0]), None)
    return ROBUST.explains(_solve_from(problem, homing.noise, guesses, ROBUST), problem)


def _solve_from(
    problem: StartProblem, noise: ReadingNoise, guesses: list[Array], judgement: Judgement
) -> ArrowSolution | None:
    """The best solution, or the first good one; None without guesses that can be computed."""
    best = None
    for poses in guesses:
        border = problem.start_border(poses[0])
        if not np.isfinite(problem.linearize(noise, poses, border).residuals).all():
            continue
        solution = problem.solve(noise, poses, border)
        if np.isfinite(judgement.loss_limit) and solution.converged:
            blocks, shared = solution.blocks, solution.border
            solution = problem.solve(noise, blocks, shared, judgement.loss_limit)
        best = min((best, solution), key=_rank_of_solution)
        if judgement.explains(best, problem):
            break
    return best


def _rank_of_solution(solution: ArrowSolution | None) -> tuple[bool, float]:
    return (True, np.inf) if solution is None else (not solution.converged, solution.cost)


def model_for(homing: Homing, pose: Array) -> RestModel:
    """What is read at rest, with the rows that homing.toml has readings for."""
    return RestModel(
        homing.robot,
        free_indices(homing.robot, pose),
        with_tensions=homing.readings.tension_N is not None and homing.noise.tension_N is not None,
        with_tilt=homing.readings.tilt_rad is not None,
    )
