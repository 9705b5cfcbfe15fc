"""Start states that the wires allow, as plain numbers: a chart about a first pose.

2 (6 - n) numbers, along free directions of the first pose, and the wires' lengths name a pose and
its rates: lengths and their rates are then exactly those asked for, whatever step a fit takes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.model.batch import evaluate, only, with_jacobian
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array

_SWEEPS = 30
_TOLERANCE = 1e-12  # m and m/s: a thousandth of the smallest length error that counts


@dataclass(frozen=True, slots=True)
class Chart:
    """Numbers for the start states about a pose.

    Attributes:
        model: the robot's equations.
        zeta: the pose in the middle of the chart, (6,).
        free: orthonormal directions that the wires leave there, (6, 6 - n).
    """

    model: Model
    zeta: Array
    free: Array

    @classmethod
    def about(cls, model: Model, zeta: Array) -> Chart:
        """The chart about a pose (6,)."""
        jacobian = evaluate(only(model.cables, 3), zeta, model.start_values)[0]
        free = np.linalg.svd(jacobian)[2][model.robot.n_cables :].T
        return cls(model, np.array(zeta), free)

    def numbers(self, zeta: Array, rates: Array) -> Array:
        """What names a pose and rates near the middle, (2 (6 - n),)."""
        return np.concatenate([self.free.T @ (zeta - self.zeta), self.free.T @ rates])

    def state(
        self, numbers: Array, lengths_m: Array, time_s: float, inertia: Array, values: Array
    ) -> Array:
        """[zeta; rates] (12,) of the numbers at these wire lengths.

        Raises:
            ValueError: where the wires allow no such state near the middle.
        """
        pose, speed = np.split(numbers, 2)
        state = np.concatenate([self.zeta + self.free @ pose, self.free @ speed])
        gap = np.full(12, np.inf)
        for _ in range(_SWEEPS):
            gap, slope, _ = self._conditions(state, numbers, lengths_m, time_s, inertia, values)
            step = np.linalg.solve(slope, gap)
            # A long step may leave the region in which this is Newton's method.
            state = state - step * min(1.0, 0.2 / max(float(np.abs(step[:6]).max()), 1e-300))
            if np.abs(gap).max() < _TOLERANCE:
                return state
        raise ValueError(
            f"no start pose near {np.round(self.zeta, 3)} has wires of {np.round(lengths_m, 4)} m "
            f"(off by {np.abs(gap).max():.2g}): check cable_lengths_m and the geometry"
        )

    def slopes(
        self, state: Array, lengths_m: Array, time_s: float, inertia: Array, values: Array
    ) -> tuple[Array, Array, Array]:
        """Derivatives of the state (12, ..) by numbers, by lengths and by [inertia; values]."""
        numbers = self.numbers(state[:6], state[6:])
        asked = numbers, lengths_m, time_s, inertia, values
        _, slope, by_rest = self._conditions(state, *asked)
        n, count = len(lengths_m), len(numbers)
        right = np.zeros((12, count + n))
        right[:n, count:] = np.eye(n)
        right[n:6, : count // 2] = np.eye(count // 2)
        right[6 + n :, count // 2 : count] = np.eye(count // 2)
        found = np.linalg.solve(slope, np.hstack([right, -by_rest]))
        return found[:, :count], found[:, count : count + n], found[:, count + n :]

    def _conditions(
        self,
        state: Array,
        numbers: Array,
        lengths_m: Array,
        time_s: float,
        inertia: Array,
        values: Array,
    ) -> tuple[Array, Array, Array]:
        """The twelve conditions, their slopes by the state (12, 12) and by the rest (12, 9 + k)."""
        at = time_s, state[:6], state[6:], inertia, values
        told, told_slope = evaluate(with_jacobian(self.model.told, (1, 2, 3, 4)), *at)
        slip, slip_slope = evaluate(with_jacobian(self.model.slip, (1, 2, 3, 4)), *at)
        off = self.numbers(state[:6], state[6:]) - numbers
        half = len(off) // 2
        gap = np.concatenate([told - lengths_m, off[:half], slip, off[half:]])
        zero = np.zeros((half, 6))
        along = np.hstack([self.free.T, zero]), np.hstack([zero, self.free.T])
        slope = np.vstack([told_slope[:, :12], along[0], slip_slope[:, :12], along[1]])
        rest = np.zeros((12, told_slope.shape[1] - 12))
        n = len(lengths_m)
        rest[:n], rest[6 : 6 + n] = told_slope[:, 12:], slip_slope[:, 12:]
        return gap, slope, rest
