"""Where the search for elastic cables begins, and how it stays with their swings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.effects import Effect, driven_catalogue
from freeswing.ident.drive.joint import Estimate, Premise, Problem, estimate
from freeswing.ident.drive.run_problem import head_of
from freeswing.ident.drive.unknowns import Asked

Array = NDArray[np.float64]

FIRST_HEAD_S = 0.15  # of a run: a cable's swings turn by less than ten radians
HEAD_STEPS = 10  # each head only leads to the next, which begins within a radian


def stretches(name: str) -> bool:
    """Whether a number, by its full name, is of an effect that makes cables elastic."""
    effect = driven_catalogue().get(name.partition(".")[0])
    return effect is not None and type(effect).stretch is not Effect.stretch


def known_at_rest(given: Premise, asked: Asked) -> Premise:
    """The premise with the geometry and the stretch that static poses tell, where there are any."""
    if given.static is None:
        return given
    dynamic = asked.groups[asked.n_kinematic :]
    stretch = tuple(group for group in dynamic if stretches(group.name))
    at_rest = Asked((*asked.kinematic.groups, *stretch), asked.n_kinematic)
    found = estimate(replace(given, runs=()), at_rest)
    return replace(given, theta=found.theta, offsets=found.offsets)


def best_start(given: Premise, asked: Asked, starts: Sequence[Array]) -> Premise:
    """The premise at those of some numbers that follow the runs' first heads best."""
    heads = tuple(head_of(run, FIRST_HEAD_S) for run in given.runs)
    costs = []
    for theta in starts:
        problem = Problem(replace(given, theta=theta, runs=heads), asked)
        try:
            costs.append(problem.normal(problem.start()).cost)
        except ValueError:  # numbers that lose the platform
            costs.append(np.inf)
    return replace(given, theta=starts[int(np.argmin(costs))])


def followed(
    given: Premise, asked: Asked, first_s: float = FIRST_HEAD_S, lost: float = np.inf
) -> Estimate:
    """The estimate to which longer and longer heads of the runs lead.

    A cable's own swings tell its stiffness, and of a whole run only within a radian at its end:
    from farther off the search ends in another minimum, where they are a turn apart. What a wrong
    drum does grows along a run in the same way.

    Args:
        given: what the fit takes as given, where the search begins.
        asked: the unknowns.
        first_s: the first heads' length.
        lost: a head with a larger mean square over the noise is not followed any farther.

    Raises:
        ValueError: where a head is lost, or a run cannot be simulated.
    """
    longest = max(len(run.record.times_s) / run.rate_hz for run in given.runs)
    seconds = first_s
    while seconds < longest:
        heads = tuple(head_of(run, seconds) for run in given.runs)
        found = estimate(replace(given, runs=heads), asked, HEAD_STEPS)
        at = found.found.normal
        if 2.0 * at.cost > lost * at.n:
            raise ValueError(f"the first {seconds:g} s of the runs are not explained")
        given = replace(given, theta=found.theta, offsets=found.offsets)
        seconds *= 2.0
    return estimate(given, asked)
