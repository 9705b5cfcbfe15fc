"""Orientations read the wrong way: quaternions as x y z w, or those of the base in the platform.

Every turn is a turn, so no file tells it. Locked cables do: they keep their length, and the one
that is stated, where the orientations are read as they were meant.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.measured.quaternion_readings import LEFT_OVER, READINGS
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.robot import Array, Robot
from freeswing.cdpr.rotation import matrix_from_quaternion, quaternion_from_matrix
from freeswing.ident.runs import SwingRun

# Geometry known to a centimetre moves lengths by some mm along a swing: more is another matter.
LENGTHS_OFF_M = 0.02


def mistaken_quaternions(run: SwingRun, robot: Robot) -> tuple[str, str]:
    """How a run's orientations were meant, and what to do; empty where they are read right.

    Source:
        Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, ch. 2: unit
        quaternions, their order and conjugate.
    """
    try:
        part = run.trajectory.window(*run.window_s) if run.window_s else run.trajectory
    except DataError:  # an empty window is said where the run is prepared
        return "", ""
    part = part.take(part.is_known) if part.is_pose and part.is_known.any() else None
    if part is None:
        return "", ""
    model = build_model(robot)
    found = _lengths_off(model, part, run.lengths_m)
    if found < LENGTHS_OFF_M:
        return "", ""
    q = quaternion_from_matrix(part.rotations())
    # q and -q are one turn, but not once w stands elsewhere: signs follow the sample before.
    signs = np.cumprod(np.where(np.sum(q[1:] * q[:-1], axis=1) < 0.0, -1.0, 1.0))
    q[1:] *= signs[:, None]
    off = {}
    for reading, (mend, _) in READINGS.items():
        rotations = matrix_from_quaternion(mend(q))
        other = Trajectory.from_poses(part.times_s, part.positions(), rotations)
        off[reading] = _lengths_off(model, other, run.lengths_m)
    best = min(off, key=off.__getitem__)
    if off[best] > LEFT_OVER * found:
        return "", ""
    told = (
        f"cable lengths are off by {1e3 * found:.0f} mm" if np.isfinite(found) else "no cable fits"
    )
    return f"{best}: {told} as recorded, by {1e3 * off[best]:.1f} mm so", READINGS[best][1]


def refuse_mistaken_quaternions(swings: Sequence[SwingRun], robot: Robot) -> None:
    """Refuse runs whose orientations fit the cables once they are read another way.

    Raises:
        DataError: naming the runs, and what to do.
    """
    told = [(swing.name, *mistaken_quaternions(swing, robot)) for swing in swings]
    wrong = [one for one in told if one[1]]
    if wrong:
        name, said, remedy = wrong[0]
        more = f" (and {len(wrong) - 1} more runs)" if len(wrong) > 1 else ""
        raise DataError(f"run {name}{more}: {said}; {remedy}")


def _lengths_off(model: Model, poses: Trajectory, stated_m: Array | None) -> float:
    """What cables change along a run (98 % of its samples) or are off what is stated, m."""
    lengths = evaluate(model.lengths, poses.values, model.start_values)[0].reshape(len(poses), -1)
    if not np.isfinite(lengths).all():
        return np.inf
    spread = float(np.ptp(np.percentile(lengths, [1.0, 99.0], axis=0), axis=0).max())
    if stated_m is None or len(stated_m) != lengths.shape[1]:
        return spread
    return max(spread, float(np.abs(lengths.mean(axis=0) - stated_m).max()))
