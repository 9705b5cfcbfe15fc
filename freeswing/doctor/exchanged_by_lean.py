"""Lengths of one another's wires on a bench that no full pose shows: by how the platform leans.

On parallel wires the angles that are not free follow from the wires' lengths alone: which one is
long shows in them, whatever hangs there.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.robot import POSE_COORDINATES, Array, Robot, spread_of
from freeswing.ident.bench.runs import Bench, BenchRun
from freeswing.ident.likelihood.rest_pose import rest_near
from freeswing.ident.signals.usable_runs import guessed_inertia
from freeswing.session.exchanged_lengths import BENCH_DIFFERENCE_M, LEFT_OVER, named_cables

LEANS = ("phi", "theta")


def leans_shown(run: BenchRun, robot: Robot) -> tuple[str, ...]:
    """The angles that a run measures and that its wires' lengths alone settle."""
    free = robot.free_coordinates or ()
    return tuple(name for name in LEANS if name in run.coordinates and name not in free)


def refuse_exchanged_by_lean(bench: Bench, robot: Robot) -> None:
    """Refuse runs without poses whose cable_lengths_m fit how it leans once some are exchanged.

    Raises:
        DataError: naming the runs, the wires and by how much.
    """
    found = []
    for run in bench.runs:
        partial = run.coordinates != POSE_COORDINATES and run.lengths_m is not None
        if partial and leans_shown(run, robot):
            told = exchanged_by_lean(run, robot)
            found += [f"run {run.name}: {told}"] if told else []
    if found:
        more = f" and {len(found) - 3} more runs" if len(found) > 3 else ""
        raise DataError(f"{'; '.join(found[:3])}{more}: put each cable's length in its place")


def exchanged_by_lean(run: BenchRun, robot: Robot) -> str:
    """Which of a run's stated lengths are other wires', empty where they are not.

    Args:
        run: with an angle that its wires settle.
        robot: whose wires.

    Source:
        Carricato, Merlet 2013, Stability analysis of underconstrained cable-driven parallel robots,
        sec. II: lengths and weight settle where a platform rests.
    """
    stated = run.lengths_m
    if stated is None or len(stated) != robot.n_cables or np.ptp(stated) < BENCH_DIFFERENCE_M:
        return ""
    model, shown = build_model(robot), leans_shown(run, robot)
    if _off(model, run, shown, stated) < BENCH_DIFFERENCE_M:
        return ""
    orders = list(permutations(range(len(stated))))
    off = [_off(model, run, shown, stated[list(order)]) for order in orders]
    best = int(np.argmin(off))
    wrong = float(np.abs(stated[list(orders[best])] - stated).max())
    if wrong < BENCH_DIFFERENCE_M or off[best] > LEFT_OVER * min(wrong, off[0]):
        return ""
    moved = np.flatnonzero(np.array(orders[best]) != np.arange(len(stated)))
    return (
        f"{named_cables(robot, moved)}, up to {1e3 * wrong:.0f} mm apart, are exchanged: as "
        f"stated the platform would lean {1e3 * off[0]:.0f} mm from how {' and '.join(shown)} "
        f"have it, in each other's place {1e3 * off[best]:.1f} mm"
    )


def _off(model: Model, run: BenchRun, shown: Sequence[str], lengths_m: Array) -> float:
    """By how much the lean at some lengths is off the measured one, m at the wires' ends."""
    columns = [POSE_COORDINATES.index(name) for name in run.coordinates]
    signals = {signal.column: signal.values for signal in run.signals}
    middle = np.array([float(np.nanmean(signals[name])) for name in run.coordinates])
    try:
        inertia = guessed_inertia(model.robot)
        rest = rest_near(model, lengths_m, inertia, columns, middle, run.name)
    except (ValueError, np.linalg.LinAlgError):
        return np.inf
    leans = [k for k, name in enumerate(run.coordinates) if name in shown]
    return spread_of(model.robot.attachments_m) * float(
        np.linalg.norm((rest.zeta[columns] - middle)[leans])
    )
