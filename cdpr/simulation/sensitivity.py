"""How a free motion answers to its initial state, the inertia and the effects: exact derivatives.

The collocation equations of every segment are linearised at once; one small solve a segment gives
its transition, and the chain of transitions the whole motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.cdpr.model.batch import evaluate, jacobians_about, moved_columns, with_jacobian
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.collocation import interpolation, of_segments, table
from freeswing.cdpr.simulation.free_swing import Motion

STATE = 12


@dataclass(frozen=True, slots=True)
class Linearised:
    """Derivatives of a simulated motion by u = [zeta_0; rates_0; inertia; values], 21 + k of them.

    Attributes:
        motion: the motion.
        asked: those that were asked for, ascending places in u: by default all; the first twelve
            always.
        columns: those of them that are told, (c,); those by the others asked for are zero.
        states: of [zeta; rates] at the segment starts, (s, 12, c).
        accelerations: of the node accelerations, (s, m, 6, c).
        matrices: of the collocation equations, one a segment, (s, 6 m, 6 m).
        by_start: derivatives of a segment's node accelerations by its own start, (s, 6 m, 12).
        ends: of the state at a segment's end by that at its start, (s, 12, 12).
    """

    motion: Motion
    asked: np.ndarray
    columns: np.ndarray
    states: Array
    accelerations: Array
    matrices: Array
    by_start: Array
    ends: Array

    def at(self, times_s: Array) -> tuple[Array, Array]:
        """Derivatives of zeta and of the rates at times (n,), each (n, 6, c)."""
        motion, (s, m) = self.motion, self.accelerations.shape[:2]
        index, fractions = motion.locate(times_s)
        once = interpolation(m, fractions)[1]
        step = motion.steps_s[:, None, None]
        nodes, speeds = self.accelerations.reshape(s, m, -1), self.states[:, 6:].reshape(s, 1, -1)
        parts = np.concatenate([speeds, step * nodes], axis=1)
        rates = of_segments(np.column_stack([np.ones(len(index)), once]), parts, index)
        return self.poses_at(times_s), rates.reshape(len(index), 6, -1)

    def poses_at(self, times_s: Array) -> Array:
        """Derivatives of zeta alone at times (n,), (n, 6, c)."""
        motion, (s, m) = self.motion, self.accelerations.shape[:2]
        index, fractions = motion.locate(times_s)
        twice = interpolation(m, fractions)[2]
        step = motion.steps_s[:, None, None]
        states = self.states.reshape(s, 2, -1) * np.concatenate([np.ones_like(step), step], axis=1)
        parts = np.concatenate([states, step**2 * self.accelerations.reshape(s, m, -1)], axis=1)
        weights = np.column_stack([np.ones(len(index)), fractions, twice])
        return of_segments(weights, parts, index).reshape(len(index), 6, -1)


def linearise(motion: Motion, still: int = 0, wanted: np.ndarray | None = None) -> Linearised:
    """Derivatives of a motion that obeys its equations.

    Args:
        motion: the motion.
        still: how many of the last values do nothing where they stand, which is quicker.
        wanted: by which of the inertia and the values, (9 + k,) booleans; None: by all. What is
            held costs nothing then.
    """
    t = table(motion.accelerations.shape[1])
    step = motion.steps_s[:, None, None]
    zetas = (
        motion.zetas[:, None]
        + step * t.nodes[:, None] * motion.rates[:, None]
        + step**2 * (t.twice @ motion.accelerations)
    )
    rates = motion.rates[:, None] + step * (t.once @ motion.accelerations)
    times = motion.starts_s[:, None] + motion.steps_s[:, None] * t.nodes
    asked = np.arange(STATE + motion.inertia.size + motion.values.size)
    columns = asked
    if wanted is None:
        slopes = _slopes(motion, still, times, zetas, rates)
    else:
        asked = asked[np.concatenate([np.ones(STATE, dtype=bool), wanted])]
        slopes, columns = _slopes_by(motion, asked, times, zetas, rates)
    matrices, changes = _segment_changes(motion, slopes)
    states, ends = _chained(motion, changes)
    flat = changes.reshape(len(states), -1, changes.shape[-1])
    total = flat[..., :12] @ states
    total[..., 12:] += flat[..., 12:]
    accelerations = total.reshape(changes.shape)
    by_start, ends = flat[..., :STATE], ends[..., :STATE]
    return Linearised(motion, asked, columns, states, accelerations, matrices, by_start, ends)


def _slopes(motion: Motion, still: int, *instants: Array) -> Array:
    """Of the accelerations by [zeta; rates; inertia; values] at instants (s, m), (s, m, 6, c)."""
    force = motion.model.acceleration
    if not still:
        function = with_jacobian(force, (1, 2, 3, 4))
        return evaluate(function, *instants, motion.inertia, motion.values)[1]
    first = len(motion.values) - still
    numbers = tuple(float(value) for value in motion.values[first:])
    parts = [
        evaluate(function, *instants, motion.inertia, motion.values[:first])[0]
        for function in jacobians_about(force, numbers)
    ]
    return np.concatenate(parts, axis=-1)


def _slopes_by(motion: Motion, asked: np.ndarray, *instants: Array) -> tuple[Array, np.ndarray]:
    """The same by some columns, (s, m, 6, c), and which of these are told."""
    function, moved = moved_columns(motion.model.acceleration, (1, 2, 3, 4), tuple(asked.tolist()))
    found = evaluate(function, *instants, motion.inertia, motion.values)[0]
    columns = np.union1d(np.arange(STATE), np.array(moved, dtype=np.int64))
    if len(columns) == len(moved):
        return found, columns
    whole = np.zeros((*found.shape[:-1], len(columns)))
    whole[..., np.searchsorted(columns, moved)] = found
    return whole, columns


def _segment_changes(motion: Motion, slopes: Array) -> tuple[Array, Array]:
    """Matrices (s, 6 m, 6 m), and what their inverses make of all that a segment depends on.

    That is the node accelerations' derivatives by [zeta_s; rates_s; inertia; values], (s, m, 6, c).
    """
    s, m = slopes.shape[:2]
    t = table(m)
    by_zeta, by_rates, by_rest = slopes[..., :6], slopes[..., 6:12], slopes[..., 12:]
    step = motion.steps_s[:, None, None, None]
    drifting = by_rates + by_zeta * step * t.nodes[:, None, None]
    right = np.concatenate([by_zeta, drifting, by_rest], axis=-1)
    step = step[..., None]
    matrix = t.twice[:, None, :, None] * (-(step**2) * by_zeta[:, :, :, None, :])
    matrix -= t.once[:, None, :, None] * (step * by_rates[:, :, :, None, :])
    matrix = matrix.reshape(s, 6 * m, 6 * m)
    matrix[:, np.arange(6 * m), np.arange(6 * m)] += 1.0
    return matrix, np.linalg.solve(matrix, right.reshape(s, 6 * m, -1)).reshape(s, m, 6, -1)


def _chained(motion: Motion, changes: Array) -> tuple[Array, Array]:
    """Derivatives of the states at the segment starts by the unknowns, and across each segment.

    Both are (s, 12, c); the second by the segment's own start instead of the motion's.
    """
    s, m, _, columns = changes.shape
    t = table(m)
    step = motion.steps_s[:, None, None]
    nodes = changes.reshape(s, m, -1)
    shape = (s, 6, columns)
    ends = np.concatenate(
        [
            step**2 * (t.twice_end @ nodes).reshape(shape),
            step * (t.once_end @ nodes).reshape(shape),
        ],
        axis=1,
    )
    ends[:, np.arange(12), np.arange(12)] += 1.0
    ends[:, np.arange(6), np.arange(6, 12)] += motion.steps_s[:, None]
    states = np.zeros((s, 12, columns))
    states[0, np.arange(12), np.arange(12)] = 1.0
    for k in range(s - 1):
        states[k + 1] = ends[k, :, :12] @ states[k]
        states[k + 1, :, 12:] += ends[k, :, 12:]
    return states, ends
