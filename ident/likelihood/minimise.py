"""Least squares over all runs: Gauss-Newton steps that may climb out of a curved valley.

Where a swing's decay is wrong, a good step raises the cost for once: what it leaves in the
directions that data see best is second order, and the next step takes it away. Such a step stands
when the next one is shorter (natural monotonicity: Deuflhard, Newton Methods for Nonlinear
Problems, 2011, sec. 4.3), for a few steps (a watchdog: Nocedal and Wright, Numerical Optimization,
2006, sec. 15.6); else the search goes back to the best place and is damped (Levenberg, Marquardt).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.descent import STUCK, Stop, converged, out_of_steps
from freeswing.ident.likelihood.joint_problem import Linear, Problem, State, Step

FIRST_DAMPING = 1e-7  # of the largest curvature: below, a damped step is the full one
LARGEST_DAMPING = 1e2  # a step so damped goes nowhere
SHORTER = 0.95  # than the last step is the next one where the search converges
MOST_RISES = 3  # steps above the best cost, until it has to be beaten
NEGLIGIBLE = 1e-4  # of the tolerance: not worth a simulation


@dataclass(frozen=True, slots=True)
class Place:
    """A state with its cost, and all runs to first order."""

    state: State
    cost: float
    linear: Linear


def minimised(
    problem: Problem, state: State, steps: int, tolerance: float
) -> tuple[State, Step, int, Stop]:
    """The state of least cost, the step that led to it, how many were taken, and why it stopped.

    Of the step, what counts is its triangle.

    Args:
        problem: what is minimised.
        state: where to start; motions that belong to it are not simulated again.
        steps: at most so many.
        tolerance: converged when an undamped step lowers the cost by less, as it promises or does.

    Raises:
        ValueError: when the start cannot be simulated, naming the run.
    """
    here = best = _place(problem, problem.rescaled(problem.begun(state)))
    damping, rises, taken, falls = 0.0, 0, 0, False
    for taken in range(1, steps + 1):
        step = problem.step(here.state, here.linear, damping)
        if falls and damping > 0.0 and step.decrease < tolerance:
            damping, step = 0.0, problem.step(here.state, here.linear, 0.0)
        promised = step.decrease if damping == 0.0 else np.inf
        if promised < NEGLIGIBLE * tolerance and here is best:
            return best.state, step, taken, _converged(promised)
        trial = problem.moved(here.state, step, here.linear.surroundings)
        lower = np.inf if trial is None else problem.cost(trial)
        gain = best.cost - lower
        settled = promised < tolerance or (gain < tolerance and damping == 0.0 and here is best)
        if trial is not None and settled and abs(gain) < tolerance:
            kept = problem.rescaled(trial) if gain >= 0.0 else best.state
            return kept, step, taken, _converged(gain)
        falls = gain > 0.0
        if trial is not None and falls:
            here = best = _place(problem, problem.rescaled(trial))
            damping, rises = (0.0 if damping < FIRST_DAMPING / 10.0 else damping / 4.0), 0
            continue
        if trial is not None and damping == 0.0 and rises < MOST_RISES:
            further = _place(problem, trial)
            next_step = problem.step(further.state, further.linear, 0.0)
            if next_step.length < SHORTER * step.length:
                here, rises = further, rises + 1
                continue
        here, damping = best, max(FIRST_DAMPING, 10.0 * damping)
        if damping > LARGEST_DAMPING:
            break
    step = problem.step(best.state, best.linear, 0.0)
    failed = damping > LARGEST_DAMPING
    stop = STUCK if failed else out_of_steps(steps)
    return best.state, step, taken, stop


def _place(problem: Problem, state: State) -> Place:
    return Place(state, problem.cost(state), problem.linear(state))


def _converged(gain: float) -> Stop:
    return converged(f"the last step lowered the cost by {max(gain, 0.0):.2g}")
