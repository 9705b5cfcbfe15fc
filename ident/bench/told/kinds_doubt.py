"""What deviations count where runs differ by what they carry: the fit that has no such scatter.

A hold of yaw, a radius or a mass that is off is the same in all runs of a kind. Taken for chance,
it is divided by the root of the number of runs, and the declared mass stays where it is: with a
clamp that holds yaw by three per cent Izz was three per cent off, twenty-two of its deviations.
Without the scatter, and with the mass left to the payload runs, the fit answers to it another way.
How far apart the two are is what is not known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.bench.fit_rounds import FINE, Solved
from freeswing.ident.bench.mass_verdict import mass_left_free
from freeswing.ident.bench.told.scatter_by_kind import is_systematic
from freeswing.ident.likelihood.fit import Solution, fit


def with_kinds_counted(solved: Solved) -> Solved:
    """A fit whose deviations hold what goes with what runs carry; as it was where nothing does.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, sec. F.2.4.5: a
        correction that is not applied counts in full.
    """
    if not is_systematic(solved):
        return solved
    unknowns = solved.solution.unknowns.without("scatter")
    if solved.mass is not None:
        unknowns = mass_left_free(unknowns, solved.mass)
    try:
        other = fit(solved.swings, unknowns, FINE)
    except (ValueError, np.linalg.LinAlgError):
        return solved
    counted = with_differences(solved.solution, [(solved.solution, other)])
    return replace(solved, solution=counted)


def with_differences(found: Solution, pairs: Sequence[tuple[Solution, Solution]]) -> Solution:
    """A fit whose covariance counts in full what pairs of fits differ by.

    Args:
        found: the fit.
        pairs: of fits that the runs cannot tell apart; blocks that either lacks do not count.
    """
    for one, other in pairs:
        both = [name for name in one.unknowns.names if name in other.unknowns]
        found = with_change(found, {name: other.value(name) - one.value(name) for name in both})
    return found


def with_change(found: Solution, changes: Mapping[str, Array]) -> Solution:
    """A fit whose covariance counts a change of its shared blocks, by name, in full."""
    parts = [
        np.ravel(changes.get(block.name, np.zeros(block.size))) for block in found.unknowns.shared
    ]
    change = np.concatenate(parts)
    return replace(found, covariance=found.covariance + np.outer(change, change))
