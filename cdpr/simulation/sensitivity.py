"""How a free motion answers to its initial state, the inertia and the effects: exact derivatives.

The collocation equations of every segment are linearised at once; one small solve a segment gives
its transition, and the chain of transitions the whole motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.linalg import get_lapack_funcs

from freeswing.cdpr.model.batch import (
    evaluate,
    jacobian_about,
    jacobian_by_others,
    moved_columns,
)
from freeswing.cdpr.robot import Array
from freeswing.cdpr.simulation.collocation import interpolation, of_segments, table
from freeswing.cdpr.simulation.free_swing import Motion

STATE = 12
_factored, _solved = get_lapack_funcs(("getrf", "getrs"), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Factors:
    """LU factors of a stack of square matrices, for as many right sides as come.

    Attributes:
        parts: triangles and pivots of each transposed matrix, as LAPACK tells them.
    """

    parts: tuple[tuple[Array, Array], ...]

    @classmethod
    def of(cls, matrices: Array) -> Factors:
        """Factors of matrices (s, n, n), which are lost.

        Raises:
            LinAlgError: when one is singular.

        Source:
            Golub, Van Loan 2013, Matrix Computations, sec. 3.4: partial pivoting.
        """
        # A transposed matrix lies in memory as LAPACK wants it.
        found = [_factored(one.T, overwrite_a=True) for one in matrices]
        if any(info > 0 for _, _, info in found):
            raise np.linalg.LinAlgError("Singular matrix")
        return cls(tuple((triangles, pivots) for triangles, pivots, _ in found))

    def solved(self, right: Array) -> Array:
        """What the matrices turn into right sides (s, n) or (s, n, c), of their shape."""
        pairs = zip(self.parts, right, strict=True)
        return np.array([_solved(*part, one, trans=1)[0] for part, one in pairs])


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
        factors: of the collocation equations' matrices, one a segment, (6 m, 6 m).
        by_start: derivatives of a segment's node accelerations by its own start, (s, 6 m, 12).
        ends: of the state at a segment's end by that at its start, (s, 12, 12).
    """

    motion: Motion
    asked: np.ndarray
    columns: np.ndarray
    states: Array
    accelerations: Array
    factors: Factors
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


def linearise(motion: Motion, wanted: np.ndarray | None = None, still: int = 0) -> Linearised:
    """Derivatives of a motion that obeys its equations.

    Args:
        motion: the motion.
        wanted: by which of the inertia and the values, (9 + k,) booleans; None: by all. What is
            held costs nothing then.
        still: how many of the last values do nothing where they stand, which is quicker.
    """
    times, zetas, rates = _at_nodes(motion)
    asked = columns = np.arange(STATE + motion.inertia.size + motion.values.size)
    if wanted is not None:
        asked = asked[np.concatenate([np.ones(STATE, dtype=bool), wanted])]
    slopes, moved = _slopes(motion, asked, still, times, zetas, rates)
    if wanted is not None:
        columns = np.union1d(np.arange(STATE), moved)
    if len(columns) > len(moved):
        dense = np.zeros((*slopes.shape[:-1], len(columns)))
        dense[..., np.searchsorted(columns, moved)] = slopes
        slopes = dense
    factors, changes = _segment_changes(motion, slopes)
    states, ends = _chained(motion, changes)
    flat = changes.reshape(len(states), -1, changes.shape[-1])
    total = flat[..., :12] @ states
    total[..., 12:] += flat[..., 12:]
    accelerations = total.reshape(changes.shape)
    by_start, ends = flat[..., :STATE], ends[..., :STATE]
    return Linearised(motion, asked, columns, states, accelerations, factors, by_start, ends)


def _at_nodes(motion: Motion) -> tuple[Array, Array, Array]:
    """Times (s, m), pose coordinates and rates (s, m, 6) at the Gauss nodes of all segments."""
    t, step = table(motion.accelerations.shape[1]), motion.steps_s[:, None, None]
    zetas = (
        motion.zetas[:, None]
        + step * t.nodes[:, None] * motion.rates[:, None]
        + step**2 * (t.twice @ motion.accelerations)
    )
    rates = motion.rates[:, None] + step * (t.once @ motion.accelerations)
    return motion.starts_s[:, None] + motion.steps_s[:, None] * t.nodes, zetas, rates


def linearise_beside(known: Linearised, motion: Motion, wanted: np.ndarray) -> Linearised:
    """Derivatives of a motion by more values that do nothing where they stand.

    What they alone change is all that is left to do. Not for stretch, which leads lengths back
    where it does nothing, too.

    Args:
        known: the motion without them, linearised by all else that is wanted.
        motion: the motion with them, after all others.
        wanted: by which of the inertia and the values, (9 + k,) booleans.

    Raises:
        ValueError: when `known` was asked for something else.
    """
    first = STATE + motion.inertia.size + known.motion.values.size
    asked = np.append(np.arange(STATE), STATE + np.flatnonzero(wanted))
    if not np.array_equal(known.asked, asked[asked < first]):
        raise ValueError("a motion is known by others than what is asked for now")
    still = motion.values.size - known.motion.values.size
    slopes = _by_still(motion, asked, still, *_at_nodes(motion))
    s, m = slopes.shape[:2]
    changes = known.factors.solved(slopes.reshape(s, 6 * m, -1))
    nodes, t, step = changes.reshape(s, m, -1), table(m), motion.steps_s[:, None, None]
    gained = [step**2 * (t.twice_end @ nodes).reshape(s, 6, -1)]
    gained.append(step * (t.once_end @ nodes).reshape(s, 6, -1))
    states, kicks = np.zeros((s, STATE, slopes.shape[-1])), np.concatenate(gained, axis=1)
    for k in range(s - 1):
        states[k + 1] = known.ends[k] @ states[k] + kicks[k]
    total = (known.by_start @ states + changes).reshape(slopes.shape)
    return Linearised(
        motion,
        asked,
        np.concatenate([known.columns, asked[asked >= first]]),
        np.concatenate([known.states, states], axis=-1),
        np.concatenate([known.accelerations, total], axis=-1),
        known.factors,
        known.by_start,
        known.ends,
    )


def _by_still(motion: Motion, asked: np.ndarray, still: int, *instants: Array) -> Array:
    """Of the accelerations by those asked for of the last values, standing still, (s, m, 6, q)."""
    moving, numbers = np.split(motion.values, [len(motion.values) - still])
    places = tuple((asked - STATE - motion.inertia.size - len(moving)).tolist())
    function = jacobian_about(motion.model.acceleration, tuple(numbers.tolist()), places)
    return evaluate(function, *instants, motion.inertia, moving)[0]


def _slopes(
    motion: Motion, asked: np.ndarray, still: int, *instants: Array
) -> tuple[Array, np.ndarray]:
    """Of the accelerations by [zeta; rates; inertia; values] at instants (s, m), (s, m, 6, c).

    By those of the columns asked for that are not zero throughout, which come second.
    """
    force, places = motion.model.acceleration, tuple(asked.tolist())
    if still:
        moving, numbers = np.split(motion.values, [len(motion.values) - still])
        others = jacobian_by_others(force, tuple(numbers.tolist()), places)
        by_others = evaluate(others, *instants, motion.inertia, moving)[0]
        by_still = _by_still(motion, asked, still, *instants)
        return np.concatenate([by_others, by_still], axis=-1), asked
    function, moved = moved_columns(force, (1, 2, 3, 4), places)
    found = evaluate(function, *instants, motion.inertia, motion.values)[0]
    return found, np.array(moved, dtype=np.int64)


def _segment_changes(motion: Motion, slopes: Array) -> tuple[Factors, Array]:
    """Factors of matrices (6 m, 6 m), and what their inverses make of all a segment depends on.

    That is the node accelerations' derivatives by [zeta_s; rates_s; inertia; values], (s, m, 6, c).
    """
    s, m = slopes.shape[:2]
    t = table(m)
    by_zeta, by_rates, by_rest = slopes[..., :6], slopes[..., 6:12], slopes[..., 12:]
    step = motion.steps_s[:, None, None, None]
    drifting = by_rates + by_zeta * step * t.nodes[:, None, None]
    right = np.concatenate([by_zeta, drifting, by_rest], axis=-1)
    both = np.concatenate([step**2 * by_zeta, step * by_rates], axis=-1)
    matrix = (both @ _spread(m)).reshape(s, 6 * m, 6 * m)
    matrix[:, np.arange(6 * m), np.arange(6 * m)] += 1.0
    factors = Factors.of(matrix)
    return factors, factors.solved(right.reshape(s, 6 * m, -1)).reshape(s, m, 6, -1)


@cache
def _spread(m: int) -> Array:
    """Takes slopes by [zeta; rates] at each node to those by all accelerations, (m, 12, 6 m)."""
    t = table(m)
    parts = [np.einsum("ij,ab->iajb", -part, np.eye(6)) for part in (t.twice, t.once)]
    return np.concatenate(parts, axis=1).reshape(m, 12, 6 * m)


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
