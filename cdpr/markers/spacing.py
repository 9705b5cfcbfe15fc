"""How far markers are apart: what tells units, exchanged labels and jumps without any pose.

Distances between points of a rigid body do not change as it moves. So everything gross is looked
for here, before a pose is fitted: whole numbers of thousand between a file and target.toml, labels
that stand at each other's places for a run or for ten frames, a marker that jumps.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.measured.rigid_fit import fit_rigid

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Pairs = NDArray[np.intp]

# A marker that jumps by more than this in one frame is not where it was: noise of motion capture
# is 0.02 to 0.2 mm, and a half-hidden marker's centroid drifts over many frames.
JUMP_M = 1e-3
# Normal noise reaches eight of its own deviations once in 1e15 samples.
JUMP_DEVIATIONS = 8.0
NORMAL_BY_MAD = 1.4826
# Two more markers have to agree before two labels are said to be exchanged.
FEWEST_TO_EXCHANGE = 4
# A renamed layout must fit ten times better than the one as labelled, and than the next renaming.
RENAMED_BETTER = 10.0
# Layouts of up to seven markers are tried in every order (5040), larger ones two labels at a time.
MOST_FOR_ALL_ORDERS = 7
# mm, cm, dm, inch and foot for m, and inch for mm; layouts are measured to better than 3 %.
UNIT_FACTORS = (1000.0, 100.0, 10.0, 1.0 / 0.0254, 1.0 / 0.3048, 25.4)
UNIT_TOLERANCE = 0.03
SMALLEST_PLATFORM_M = 0.02
LARGEST_PLATFORM_M = 10.0
_FRAMES_TO_COMPARE = 5
# Below this a layout as labelled is right whatever its noise: target.toml is measured by hand.
LABELS_FIT_M = 5e-3


@dataclass(frozen=True, slots=True)
class Exchange:
    """Labels that stood at each other's places: the indices, and the frames they did."""

    markers: tuple[int, ...]
    frames: NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Jump:
    """A marker away from its place for some frames, and how far at most."""

    marker: int
    frames: NDArray[np.intp]
    most_m: float


@dataclass(frozen=True, slots=True)
class Mended:
    """Marker positions (n_t, n_m, 3) with gross faults put right or left out, and which."""

    positions_m: Array
    exchanges: tuple[Exchange, ...] = ()
    jumps: tuple[Jump, ...] = ()

    def within(self, inside: Mask) -> Mended:
        """The same positions with the faults of some samples (n_t,) alone."""
        exchanges = (Exchange(e.markers, e.frames[inside[e.frames]]) for e in self.exchanges)
        jumps = (Jump(j.marker, j.frames[inside[j.frames]], j.most_m) for j in self.jumps)
        return Mended(
            self.positions_m,
            tuple(e for e in exchanges if len(e.frames)),
            tuple(j for j in jumps if len(j.frames)),
        )


def pairs_of(n_markers: int) -> Pairs:
    """Indices of all pairs, (n_p, 2)."""
    return np.array(list(combinations(range(n_markers), 2)), dtype=np.intp).reshape(-1, 2)


def distances(points: Array, pairs: Pairs) -> Array:
    """Distances of pairs (n_p, 2) of points (..., n_m, 3), NaN where one is missing.

    Source:
        Golub, Van Loan 2013, Matrix Computations, sec. 2.2: the Euclidean norm.
    """
    return np.linalg.norm(points[..., pairs[:, 0], :] - points[..., pairs[:, 1], :], axis=-1)


def typical_distances(points: Array, pairs: Pairs) -> Array:
    """Medians over time, (n_p,), NaN for pairs never seen together."""
    return _medians(distances(points, pairs))


def mended(points: Array) -> Mended:
    """Labels exchanged for some frames put right, and markers that jump left out of those frames.

    Args:
        points: (n_t, n_m, 3), NaN where missing.
    """
    pairs = pairs_of(points.shape[1])
    if len(pairs) < 3:
        return Mended(points)
    apart = distances(points, pairs)
    usual = _medians(apart)
    spread = NORMAL_BY_MAD * _medians(np.abs(apart - usual))
    limits = np.maximum(JUMP_DEVIATIONS * spread, JUMP_M)
    wrong = np.abs(apart - usual) > limits
    bad = np.flatnonzero(wrong.any(axis=1))
    if not len(bad):
        return Mended(points)
    result = points.copy()
    exchanges = _exchanged(result, bad, pairs, usual, limits)
    put_right = np.concatenate([e.frames for e in exchanges]) if exchanges else bad[:0]
    jumps = _left_out(result, np.setdiff1d(bad, put_right), pairs, usual, limits)
    return Mended(result, exchanges, jumps)


def unit_between(layout: Array, apart: Array) -> tuple[float, bool] | None:
    """Factor of a wrong unit between a layout and distances (n_p,), and whether the layout has it.

    None where the sizes are of one unit. The one whose size no platform has is wrong.
    """
    wanted = distances(layout, pairs_of(len(layout)))
    known = np.isfinite(apart) & (wanted > 0.0)
    if not known.any():
        return None
    ratio = float(np.median(apart[known] / wanted[known]))
    for unit in UNIT_FACTORS:
        for factor in (unit, 1.0 / unit):
            if abs(ratio / factor - 1.0) < UNIT_TOLERANCE:
                size = float(wanted.max())
                return factor, not SMALLEST_PLATFORM_M < size < LARGEST_PLATFORM_M
    return None


def renamed(layout: Array, points: Array) -> tuple[int, ...] | None:
    """The order of the recording's columns that fits the layout where the labels do not.

    None where the labels fit, where no other order does, or where several do alike.

    Args:
        layout: nominal places, (n_m, 3).
        points: (n_t, n_m, 3), NaN where missing.
    """
    seen = np.flatnonzero(np.isfinite(points).all(axis=2).any(axis=0))
    if len(seen) < len(layout):
        inner = renamed(layout[seen], points[:, seen]) if len(seen) else None
        if inner is None:
            return None
        order = np.arange(len(layout))
        order[seen] = seen[list(inner)]
        return tuple(int(k) for k in order)
    n = len(layout)
    whole = np.flatnonzero(np.isfinite(points).all(axis=(1, 2)))
    if n < FEWEST_TO_EXCHANGE or not len(whole):
        return None
    pairs = pairs_of(n)
    wanted = distances(layout, pairs)
    found = np.full((n, n), np.nan)
    found[pairs[:, 0], pairs[:, 1]] = found[pairs[:, 1], pairs[:, 0]] = typical_distances(
        points, pairs
    )
    if np.abs(found[pairs[:, 0], pairs[:, 1]] - wanted).max() < LABELS_FIT_M:
        return None
    orders = np.array(_orders(n))
    misfit = found[orders[:, pairs[:, 0]], orders[:, pairs[:, 1]]] - wanted
    ranked = np.argsort(np.sqrt(np.mean(misfit**2, axis=1)), kind="stable")[:20]
    frames = points[whole[np.linspace(0, len(whole) - 1, _FRAMES_TO_COMPARE).astype(int)]]
    errors = np.array([_rigid_error(layout, frames[:, orders[k]]) for k in ranked])
    as_labelled = _rigid_error(layout, frames)
    best, second = np.argsort(errors, kind="stable")[:2]
    clear = errors[best] * RENAMED_BETTER < min(as_labelled, float(errors[second]))
    order = tuple(int(i) for i in orders[ranked[best]])
    return order if clear and order != tuple(range(n)) else None


def _rigid_error(layout: Array, frames: Array) -> float:
    R, t = fit_rigid(layout, frames)
    miss = frames - np.einsum("tij,mj->tmi", R, layout) - t[:, None]
    return float(np.sqrt(np.mean(miss**2))) if np.isfinite(miss).all() else float("inf")


def _orders(n: int) -> list[tuple[int, ...]]:
    if n <= MOST_FOR_ALL_ORDERS:
        return list(permutations(range(n)))
    return [tuple(range(n)), *_small_exchanges(n)]


def _small_exchanges(n: int) -> list[tuple[int, ...]]:
    """Orders that exchange two labels or turn three of them round."""
    orders = []
    for size in (2, 3):
        for chosen in combinations(range(n), size):
            for turned in permutations(chosen):
                if all(a != b for a, b in zip(chosen, turned, strict=True)):
                    order = list(range(n))
                    for a, b in zip(chosen, turned, strict=True):
                        order[a] = b
                    orders.append(tuple(order))
    return orders


def _exchanged(
    points: Array, bad: Pairs, pairs: Pairs, usual: Array, limits: Array
) -> tuple[Exchange, ...]:
    """Exchange labels in place in the bad frames where exactly one exchange mends everything."""
    n = points.shape[1]
    if n < FEWEST_TO_EXCHANGE:
        return ()
    seen = np.isfinite(points[bad, :, 0])
    fits = []
    orders = _small_exchanges(n)
    for order in orders:
        moved = [i for i in range(n) if order[i] != i]
        apart = distances(points[bad][:, list(order)], pairs)
        with np.errstate(invalid="ignore"):
            good = ~(np.abs(apart - usual) > limits).any(axis=1)
        fits.append(good & seen[:, moved].all(axis=1) & (seen.sum(axis=1) >= FEWEST_TO_EXCHANGE))
    table = np.array(fits)
    only = table.sum(axis=0) == 1
    found = []
    for k, order in enumerate(orders):
        frames = bad[only & table[k]]
        if len(frames):
            points[frames] = points[frames][:, list(order)]
            found.append(Exchange(tuple(i for i in range(n) if order[i] != i), frames))
    return tuple(found)


def _left_out(
    points: Array, bad: Pairs, pairs: Pairs, usual: Array, limits: Array
) -> tuple[Jump, ...]:
    """Leave out, in place, the marker that most distances accuse until none is left."""
    n = points.shape[1]
    frames: list[list[int]] = [[] for _ in range(n)]
    most = np.zeros(n)
    while len(bad):
        off = np.nan_to_num(np.abs(distances(points[bad], pairs) - usual))
        wrong = off > limits
        accused = np.zeros((len(bad), n))
        for k, pair in enumerate(pairs):
            accused[:, pair] += (wrong[:, k] * (1.0 + 1e-3 * np.tanh(off[:, k])))[:, None]
        worst = accused.argmax(axis=1)
        for marker in np.unique(worst):
            mine = worst == marker
            frames[marker] += bad[mine].tolist()
            most[marker] = max(most[marker], off[mine][:, (pairs == marker).any(axis=1)].max())
        points[bad, worst] = np.nan
        with np.errstate(invalid="ignore"):
            still = (np.abs(distances(points[bad], pairs) - usual) > limits).any(axis=1)
        bad = bad[still]
    return tuple(
        Jump(k, np.array(sorted(frames[k]), dtype=np.intp), float(most[k]))
        for k in range(n)
        if frames[k]
    )


def _medians(values: Array) -> Array:
    """Medians over time of columns that may hold NaN, NaN where a column holds nothing."""
    seen = np.isfinite(values)
    result = np.full(values.shape[1], np.nan)
    for k in np.flatnonzero(seen.any(axis=0)):
        result[k] = np.median(values[seen[:, k], k])
    return result
