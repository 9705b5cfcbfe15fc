"""`diagnose` for benches: what the model of a bench lacks, and what its bodies are with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.robot import Array, Robot
from freeswing.cdpr.system.progress import Progress
from freeswing.ident.bench.diagnose.causes import Cause, causes_of, dressed
from freeswing.ident.bench.diagnose.channels_only import ByChannels, by_channels
from freeswing.ident.bench.diagnose.errors import Errors, errors_of
from freeswing.ident.bench.diagnose.search import Ground, Round, searched
from freeswing.ident.bench.diagnose.shown import Shown, shown
from freeswing.ident.bench.diagnose.taken_for_granted import Removed, removals
from freeswing.ident.bench.diagnose.weigh import Fit
from freeswing.ident.bench.fit_rounds import FINE, Solved
from freeswing.ident.bench.held_uncertain import considered
from freeswing.ident.bench.identify_bench import BenchResult, identify_bench
from freeswing.ident.bench.mass_verdict import CONTRADICTED, MassVerdict, doubt
from freeswing.ident.bench.modal import ModalSwing
from freeswing.ident.bench.runs import Bench
from freeswing.ident.bench.swing import COMMON
from freeswing.ident.bench.told.kinds_doubt import (
    with_change,
    with_differences,
    with_kinds_counted,
)
from freeswing.ident.bench.told.scatter_by_kind import is_systematic
from freeswing.ident.bench.told.wire_ends import with_ends_counted
from freeswing.ident.likelihood.fit import Solution, fit

LEAST_RUNS = 3  # of two, either is predicted by the other alone, drag, wires and all
FEW = (
    "{count} run(s) have role identify: to leave each out in turn takes {least} or more; record "
    "further ones"
)


@dataclass(frozen=True, slots=True)
class Step:
    """One step of the ladder.

    Attributes:
        effects: that the model has beside what the files say.
        fit: of it.
        errors: of runs that it was not fitted to.
    """

    effects: tuple[str, ...]
    fit: Fit
    errors: Errors


@dataclass(frozen=True, slots=True)
class BenchDiagnosis:
    """What `diagnose` finds on a bench.

    Attributes:
        identified: what `identify` says, without any effect but drag.
        rounds: of the search.
        removed: what `identify` takes for granted, each taken away.
        ladder: what the files say, then one step an effect.
        solved: the last fit, with what deviations have to count.
        declared: the first one's, likewise.
        shares: of the platform's mass that hangs in each run, (r,).
        shown: how well the runs would tell each cause that was not found.
    """

    identified: BenchResult
    rounds: tuple[Round, ...]
    removed: tuple[Removed, ...]
    ladder: tuple[Step, ...]
    solved: Solved
    declared: Solved
    shares: Array
    shown: tuple[Shown, ...] = ()

    @property
    def accepted(self) -> tuple[Cause, ...]:
        """Causes that were found, in their order."""
        return self.ladder[-1].fit.causes


@dataclass(frozen=True, slots=True)
class CannotTell:
    """A bench whose runs tell no effect from another.

    Attributes:
        identified: what `identify` says.
        reason: why, and what to add.
    """

    identified: BenchResult
    reason: str


def diagnose_bench(
    bench: Bench,
    robot: Robot,
    progress: Progress | None = None,
    only: Sequence[str] | None = None,
) -> BenchDiagnosis | ByChannels | CannotTell:
    """Find what a bench lacks.

    Args:
        bench: the session.
        robot: as declared.
        progress: told a label and a fraction.
        only: effects to consider; None for all that a bench may show.

    Returns:
        The diagnosis, what channels alone tell, or why there can be none.

    Raises:
        DataError: when the data cannot give a result, naming run, number and remedy.
    """
    told = progress or (lambda label, fraction: None)
    told("all runs in one fit", 0.0)
    identified = identify_bench(bench, robot)
    count = len(identified.solved.swings)
    if count < LEAST_RUNS:
        return CannotTell(identified, FEW.format(count=count, least=LEAST_RUNS))
    if isinstance(identified.solved.swings[0], ModalSwing):
        told("what channels tell", 0.5)
        return by_channels(identified)
    try:
        return _diagnosed(identified, robot, told, only)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise DataError(f"the bench's runs cannot be diagnosed: {error}") from error


def _diagnosed(
    identified: BenchResult, robot: Robot, told: Progress, only: Sequence[str] | None
) -> BenchDiagnosis:
    start = _start(identified.solved)
    masses = [
        swing.total(start.solution.unknowns.of_run(k))[0] for k, swing in enumerate(start.swings)
    ]
    shares = np.array(masses) / start.solution.value("platform")[0]
    ground = Ground(start.swings, shares, identified.solved.fastest_hz)
    causes = causes_of(robot, only)
    last, rounds = searched(
        ground, start, causes, lambda label, part: told(label, 0.3 + 0.5 * part)
    )
    if not last.causes and is_systematic(identified.solved):  # not found: counted as chance
        last = _start(identified.solved, scattered=True)
    seen = shown(ground, last, [cause for cause in causes if cause not in last.causes])
    told("what is taken for granted", 0.8)
    removed = removals(ground, last, identified.bench, only)
    told("before and after", 0.9)
    ladder = _ladder(identified.bench, ground, last, removed)
    counted = _counted(identified.solved, ladder[-1].fit, rounds)
    solved = with_ends_counted(counted, robot, identified.ends, last.causes)
    without = _counted(identified.solved, ladder[0].fit)
    declared = with_ends_counted(without, robot, identified.ends)
    told("diagnosis", 1.0)
    return BenchDiagnosis(
        identified, tuple(rounds), removed, ladder, solved, declared, shares, seen
    )


def _start(solved: Solved, scattered: bool = False) -> Fit:
    """The fit with drag and each wire's own length, all wires together as long as told.

    Scatter between runs that goes with what they carry is left out, unless it is asked for.
    """
    unknowns = solved.solution.unknowns
    unknowns = unknowns.without(*(name for name in unknowns.names if name.startswith("missing.")))
    zero = unknowns.moved({COMMON: np.zeros(1)}).held(COMMON)
    if is_systematic(solved) and not scattered:  # or causes would be taken for chance
        zero = zero.without("scatter")
    return Fit(solved.swings, fit(solved.swings, zero, FINE))


def _counted(solved: Solved, one: Fit, rounds: Sequence[Round] = ()) -> Solved:
    """A fit with the covariance that its held numbers ask for, and what it says of the mass.

    What fits with causes that cannot be told apart differ by is counted in full, and so is what
    changes with a cause that is probable and that too few runs bear out.
    """
    found = considered(one.swings, one.solution, solved.held)
    mass = solved.mass
    if mass is not None and mass.contradicted:
        value, std = float(found.value("platform")[0]), float(one.solution.std("platform")[0])
        off = abs(value - mass.declared_kg) > CONTRADICTED * std
        mass = MassVerdict(mass.declared_kg, value, std, off, mass.stated)
    if not one.causes:
        found = with_change(found, solved.doubts)
    elif solved.mass is not None and not solved.mass.contradicted:
        # With a cause the runs no longer want what they wanted without: only what is open counts.
        part = solved.mass.open_part
        found = with_change(found, {name: part * one for name, one in solved.doubts.items()})
    elif mass is not None and mass.contradicted:
        change = doubt(found, mass)
        found = replace(found, covariance=found.covariance + np.outer(change, change))
    counted = with_rounds(found, rounds)
    return with_kinds_counted(replace(solved, solution=counted, swings=one.swings, mass=mass))


def with_rounds(found: Solution, rounds: Sequence[Round]) -> Solution:
    """A fit whose covariance counts in full what the rounds of a search could not decide.

    Args:
        found: the fit.
        rounds: of the search that led there.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, sec. F.2.4.5.
    """
    pairs = [
        (step.winner.solution, rival.solution)
        for step in rounds
        if step.winner is not None
        for rival in step.rivals
    ]
    pairs += [
        (before.solution, probable.solution) for step in rounds for before, probable in step.unborne
    ]
    return with_differences(found, pairs)


def _ladder(
    bench: Bench, ground: Ground, last: Fit, removed: Sequence[Removed]
) -> tuple[Step, ...]:
    """Without all that was accepted, then with one after the other."""
    granted = [one for one in removed if one.accepted]
    names = [one.effect for one in granted]
    fits = [(names, last)]
    causes = list(last.causes)
    current = last
    while causes:
        gone = causes.pop()
        unknowns = current.solution.unknowns
        unknowns = (
            unknowns.moved({COMMON: np.zeros(1)}).held(COMMON)
            if gone.block == COMMON
            else unknowns.without(gone.block)
        )
        swings = tuple(
            replace(mine, columns=seen.columns)
            for mine, seen in zip(
                dressed(ground.swings, causes, ground.shares), last.swings, strict=True
            )
        )
        current = Fit(swings, fit(swings, unknowns, FINE), tuple(causes))
        fits.append((names, current))
    for k in range(len(granted), 0, -1):
        gone = granted[k - 1]
        unknowns = gone.without(current.solution.unknowns)
        current = Fit(current.swings, fit(current.swings, unknowns, FINE))
        fits.append((names[: k - 1], current))
    steps = []
    for granted_names, one in reversed(fits):
        effects = (*granted_names, *(cause.effect for cause in one.causes))
        steps.append(Step(effects, one, errors_of(bench, ground, one)))
    return tuple(steps)
