"""Poses and the motion between them improve each other: the way to where both agree.

What a camera saw half a frame from an instant is carried there by the motion, and the motion is
made of the poses. Taken in turns, what is wrong with an oscillation falls slowly; each turn says
how the poses answer a change of themselves, and a few together where that ends.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.rotation import exp_rotation, log_rotation
from freeswing.vision.fuse.poses import Poses

Array = NDArray[np.float64]

SETTLED = 0.05  # of deviations of poses, root mean square
MOST_TO_SETTLE = 12
_REMEMBERED = 6  # a swing has two to six oscillations
_NEGLIGIBLE = 1e-10  # of the largest: changes that say the same twice


class Settling:
    """The turns so far.

    Source:
        Walker, Ni 2011, Anderson Acceleration for Fixed-Point Iterations, SIAM J. Numer. Anal. 49,
        sec. 2.
    """

    _about: Poses
    _units: Array

    def __init__(self) -> None:
        self._ends: list[Array] = []
        self._steps: list[Array] = []

    def aim(self, start: Poses, end: Poses, deviations: Array) -> tuple[Poses, float]:
        """Where to go on from, and how far the last turn went.

        Args:
            start: poses that the turn began with.
            end: those that it gave.
            deviations: of position and small rotation, zero where these are not sought, (6,).

        Returns:
            Poses, and the root mean square of the last step in deviations.
        """
        known = end.known
        if (start.known != known).any() or not known.any():
            self._ends, self._steps = [], []
            return end, np.inf
        if not self._ends:
            self._about, self._units = end, np.where(deviations > 0.0, deviations, np.inf)
        reached = self._small(end)
        step = reached - self._small(start)
        self._ends.append(reached)
        self._steps.append(step)
        del self._ends[: -_REMEMBERED - 1], self._steps[: -_REMEMBERED - 1]
        moved = float(np.sqrt(np.mean(step**2)))
        if len(self._ends) < 2:
            return end, moved
        by_turn = np.diff(np.array(self._steps), axis=0)
        shares = np.linalg.lstsq(by_turn.T, step, rcond=_NEGLIGIBLE)[0]
        aim = (reached - shares @ np.diff(np.array(self._ends), axis=0)).reshape(-1, 6)
        aim = aim * np.where(np.isfinite(self._units), self._units, 0.0)
        places, turns = end.positions_m.copy(), end.rotations.copy()
        places[known] = self._about.positions_m[known] + aim[:, :3]
        turns[known] = exp_rotation(aim[:, 3:]) @ self._about.rotations[known]
        return replace(end, positions_m=places, rotations=turns), moved

    def _small(self, poses: Poses) -> Array:
        known = poses.known
        turns = poses.rotations[known] @ np.swapaxes(self._about.rotations[known], 1, 2)
        shifts = poses.positions_m[known] - self._about.positions_m[known]
        small = np.concatenate([shifts, log_rotation(turns)], axis=1)
        return (small / self._units).ravel()
