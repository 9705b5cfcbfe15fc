"""Stated cable lengths that are other cables': named, since no fit tells it from geometry.

Full poses tell each cable's length. Where free coordinates alone were measured, where the platform
rests tells it: at another cable's length it would hang somewhere else, or nowhere.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, permutations

import numpy as np
from scipy.optimize import linear_sum_assignment

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.model.free_motion import coordinate_indices
from freeswing.cdpr.robot import POSE_COORDINATES, Array, Robot
from freeswing.ident.likelihood.rest_pose import rest_near
from freeswing.ident.runs import SwingRun
from freeswing.ident.signals.derivatives import UnusableRunError, signals_of
from freeswing.ident.signals.usable_runs import guessed_inertia

# Told lengths come from a tape or from counted turns, good to a few mm; 20 mm is another cable's.
LENGTH_DIFFERENCE_M = 0.02
# A bench's wires and their ends are measured to 1 mm.
BENCH_DIFFERENCE_M = 0.005
# Of what was wrong, that may be left once they are exchanged: geometry as it usually is known.
LEFT_OVER = 0.2
# Another order that rests hardly farther off leaves open which one it is.
NEXT_BEST = 2.0
MOST_PLACES = 4  # cables of which every order is tried: 24 orders, each a search of 0.1 s


def refuse_exchanged_lengths(
    swings: Sequence[SwingRun], robot: Robot, least_m: float = LENGTH_DIFFERENCE_M
) -> None:
    """Refuse runs whose cable_lengths_m fit their samples once some of them are exchanged.

    Args:
        swings: the runs.
        robot: whose cables.
        least_m: by which lengths are off, by the poses, before they may be another cable's.

    Raises:
        DataError: naming the runs, the cables and by how much.
    """
    found, order, without_poses = [], None, False
    for swing in swings:
        lengths = pose_lengths(swing, robot)
        if lengths is None:
            order, told = exchanged_at_rest(swing, robot, order)
            without_poses |= bool(told)
        else:
            told = exchanged_sentence(swing, robot, lengths, least_m)
        if told:
            found.append(f"run {swing.name}: {told}")
    if found:
        more = f" and {len(found) - 3} more runs" if len(found) > 3 else ""
        remedy = "put each cable's length in its place"
        # Without poses ends of other cables make it rest elsewhere as well.
        remedy += ", or each cable's ends in robot.toml" * without_poses
        raise DataError(f"{'; '.join(found[:3])}{more}: {remedy}")


def pose_lengths(swing: SwingRun, robot: Robot) -> Array | None:
    """Mean cable lengths by the run's poses inside its window, (n,); None without poses."""
    part = swing.known_poses()
    if part is None:
        return None
    model = build_model(robot)
    lengths = evaluate(model.lengths, part.values, model.start_values)[0].reshape(len(part), -1)
    return lengths.mean(axis=0) if np.isfinite(lengths).all() else None


def exchanged_sentence(
    swing: SwingRun, robot: Robot, lengths_m: Array, least_m: float = LENGTH_DIFFERENCE_M
) -> str:
    """Which of a run's stated lengths are other cables', empty where they are not.

    Args:
        swing: the run.
        robot: whose cables.
        lengths_m: by the poses, (n,).
        least_m: off by less they are no other cable's.
    """
    stated = swing.lengths_m
    if stated is None or len(stated) != len(lengths_m):
        return ""
    off = np.abs(lengths_m - stated)
    _, places = linear_sum_assignment(np.abs(lengths_m[:, None] - stated))
    moved = np.flatnonzero(places != np.arange(len(places)))
    left = np.abs(lengths_m - stated[places])
    worst = float(off.max())
    if not len(moved) or worst < least_m or left.max() > LEFT_OVER * worst:
        return ""
    return (
        f"{named_cables(robot, moved)} are exchanged: by the poses they are "
        f"{1e3 * worst:.0f} mm off as stated, {1e3 * left.max():.1f} mm in each other's place"
    )


def exchanged_at_rest(
    swing: SwingRun, robot: Robot, before: Array | None = None
) -> tuple[Array | None, str]:
    """The same of a run without poses, by where it would rest: the order, and the sentence.

    Args:
        swing: the run; without a measured position it tells nothing.
        robot: whose cables; its inertia may be a guess, which moves the rest by millimetres.
        before: the order that an earlier run needed, tried first.

    Returns:
        Which cable's stated length is each cable's own, (n,), None where they are not exchanged,
        and a sentence, empty then.

    Source:
        Carricato, Merlet 2013, Stability analysis of underconstrained cable-driven parallel robots,
        sec. II: lengths and weight settle where a platform rests.
    """
    stated = swing.lengths_m
    part = None if stated is None else _free_part(swing)
    if stated is None or part is None or len(stated) != robot.n_cables:
        return before, ""
    model = build_model(robot)
    as_stated = _off_at_rest(model, part, stated)
    if as_stated < LENGTH_DIFFERENCE_M or not (part := _swinging(swing)):
        return before, ""
    as_stated, tried = _off_at_rest(model, part, stated), {}
    for orders in _orders(len(stated), before):
        for order in orders:
            tried[order] = _off_at_rest(model, part, stated[list(order)])
        best, *others = sorted(tried, key=tried.__getitem__)
        wrong = float(np.abs(stated[list(best)] - stated).max())
        left = tried[best]
        next_left = min((tried[one] for one in others), default=np.inf)
        limit = min(LEFT_OVER * min(wrong, as_stated), next_left / NEXT_BEST)
        if wrong >= LENGTH_DIFFERENCE_M and left <= limit:
            moved = np.flatnonzero(np.array(best) != np.arange(len(best)))
            rests = (
                f"nowhere that is near {', '.join(part.coordinates)}"
                if np.isinf(as_stated)
                else f"{1e3 * as_stated:.0f} mm from where it was measured"
            )
            return np.array(best), (
                f"{named_cables(robot, moved)}, up to {1e3 * wrong:.0f} mm apart, are exchanged: "
                f"as stated the platform rests {rests}, in each other's place {1e3 * left:.1f} mm"
            )
    return before, ""


def named_cables(robot: Robot, cables: Array) -> str:
    """Whose lengths are meant, in words; cables by their places, (k,)."""
    names = " and ".join(robot.cables[k].name for k in cables)
    return f"cable_lengths_m: the lengths of cables {names}"


def _orders(count: int, before: Array | None) -> Iterator[list[tuple[int, ...]]]:
    """Orders to try in turn: that of an earlier run, all exchanges of two, all others."""
    still = tuple(range(count))
    if before is not None:
        yield [tuple(int(k) for k in before)]
    pairs = []
    for one, other in combinations(still, 2):
        order = list(still)
        order[one], order[other] = other, one
        pairs.append(tuple(order))
    yield pairs
    if count <= MOST_PLACES:
        yield [one for one in permutations(still) if one != still and one not in pairs]


def _free_part(swing: SwingRun) -> Trajectory | None:
    """A run's known samples inside its window; None where it measures no position or all."""
    try:
        part = swing.inside()
    except DataError:  # an empty window is said where the run is prepared
        return None
    if part.is_pose or not set(POSE_COORDINATES[:3]) & set(part.coordinates):
        return None
    return part.take(part.is_known) if part.is_known.any() else None


def _swinging(swing: SwingRun) -> Trajectory | None:
    """The same of its free motion alone: held before its release, a platform is elsewhere."""
    if swing.window_s is not None:
        return _free_part(swing)
    try:
        window = signals_of(swing).window_s
    except UnusableRunError:  # said where the run is prepared
        return None
    part = swing.trajectory.window(*window)
    return part.take(part.is_known) if part.is_known.any() else None


def _off_at_rest(model: Model, part: Trajectory, lengths_m: Array) -> float:
    """How far the rest pose at some lengths is from the middle of a swing, m; infinite: none."""
    columns, middle = coordinate_indices(part.coordinates), part.values.mean(axis=0)
    try:
        inertia = guessed_inertia(model.robot)
        rest = rest_near(model, lengths_m, inertia, columns, middle, part.provenance)
    except (ValueError, np.linalg.LinAlgError):
        return np.inf
    positions = [k for k, column in enumerate(columns) if column < 3]
    return float(np.linalg.norm((rest.zeta[columns] - middle)[positions]))
