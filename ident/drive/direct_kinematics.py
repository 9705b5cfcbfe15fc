"""Poses from motor angles alone: the direct kinematic model, many samples at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.cdpr.driven.slopes import length_slope, moved, pose_map
from freeswing.cdpr.model.batch import evaluate

Array = NDArray[np.float64]

MOST_ITERATIONS = 60  # a drum 2 % off takes 24
# Metres and radians: a thousandth of an encoder step. Angles that fit no pose exactly (elastic
# cables, other geometry) make the iteration's end linear rather than quadratic.
DONE = 1e-8


def poses_from_turns(
    model: DrivenModel, theta: Array, turns: Array, start: Array
) -> tuple[Array, Array]:
    """Least-squares poses of L / r readings, and what they leave.

    Args:
        model: the equations.
        theta: their numbers.
        turns: L / r at each sample: of the zero pose less the angle, (n_t, n).
        start: poses to begin with, (n_t, 7) or (7,).

    Returns:
        Poses (n_t, 7) and residuals of the readings (n_t, n).

    Raises:
        ValueError: when the iteration does not settle: the angles fit no pose.

    Source:
        INCA 2016, eq. (2) solved by Gauss-Newton: Nocedal, Wright 2006, Numerical
        Optimization, sec. 10.3.
    """
    poses = np.array(np.broadcast_to(start, (len(turns), 7)))
    slope, shift = length_slope(model), np.full((len(turns), 6), np.inf)
    for _ in range(MOST_ITERATIONS):
        found, by_pose = evaluate(slope, poses, theta)
        gaps, jacobian = turns - found, by_pose @ pose_map(poses)
        left = np.swapaxes(jacobian, -1, -2)
        shift = np.linalg.solve(left @ jacobian, (left @ gaps[..., None]))[..., 0]
        shift = np.clip(shift, -0.3, 0.3)
        poses = moved(poses, shift)
        if np.abs(shift).max() < DONE:
            return poses, turns - evaluate(slope, poses, theta)[0]
    worst = int(np.argmax(np.abs(shift).max(axis=1)))
    raise ValueError(
        f"no pose fits the motor angles of sample {worst}: after {MOST_ITERATIONS} steps it still "
        f"moves by {np.abs(shift[worst]).max():.2g}; check signs, units and order of the angles"
    )
