"""Stated cable lengths that are other cables': named, since no fit tells it from geometry."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.robot import Array, Robot
from freeswing.ident.runs import SwingRun

# Told lengths come from a tape or from counted turns, good to a few mm; 20 mm is another cable's.
LENGTH_DIFFERENCE_M = 0.02
# Of what was wrong, that may be left once they are exchanged: geometry as it usually is known.
LEFT_OVER = 0.2


def refuse_exchanged_lengths(swings: Sequence[SwingRun], robot: Robot) -> None:
    """Refuse runs whose cable_lengths_m fit their poses once some of them are exchanged.

    Raises:
        DataError: naming the runs, the cables and by how much.
    """
    found = []
    for swing in swings:
        lengths = pose_lengths(swing, robot)
        told = "" if lengths is None else exchanged_sentence(swing, robot, lengths)
        if told:
            found.append(f"run {swing.name}: {told}")
    if found:
        more = f" and {len(found) - 3} more runs" if len(found) > 3 else ""
        raise DataError(f"{'; '.join(found[:3])}{more}: put each cable's length in its place")


def pose_lengths(swing: SwingRun, robot: Robot) -> Array | None:
    """Mean cable lengths by the run's poses inside its window, (n,); None without poses."""
    try:
        part = swing.trajectory.window(*swing.window_s) if swing.window_s else swing.trajectory
    except DataError:  # an empty window is said where the run is prepared
        return None
    poses = part.values[part.is_known]
    if not part.is_pose or not len(poses):
        return None
    model = build_model(robot)
    lengths = evaluate(model.lengths, poses, model.start_values)[0].reshape(len(poses), -1)
    return lengths.mean(axis=0) if np.isfinite(lengths).all() else None


def exchanged_sentence(swing: SwingRun, robot: Robot, lengths_m: Array) -> str:
    """Which of a run's stated lengths are other cables', empty where they are not.

    Args:
        swing: the run.
        robot: whose cables.
        lengths_m: by the poses, (n,).
    """
    stated = swing.lengths_m
    if stated is None or len(stated) != len(lengths_m):
        return ""
    off = np.abs(lengths_m - stated)
    _, places = linear_sum_assignment(np.abs(lengths_m[:, None] - stated))
    moved = np.flatnonzero(places != np.arange(len(places)))
    left = np.abs(lengths_m - stated[places])
    worst = float(off.max())
    if not len(moved) or worst < LENGTH_DIFFERENCE_M or left.max() > LEFT_OVER * worst:
        return ""
    names = " and ".join(robot.cables[k].name for k in moved)
    return (
        f"cable_lengths_m: the lengths of cables {names} are exchanged: by the poses they are "
        f"{1e3 * worst:.0f} mm off as stated, {1e3 * left.max():.1f} mm in each other's place"
    )
