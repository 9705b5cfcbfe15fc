"""Labels at each other's places, for a run or for ten frames, told by how far markers are apart."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.markers.distances import distances, pairs_of, typical_distances
from freeswing.cdpr.measured.rigid_fit import fit_rigid

Array = NDArray[np.float64]
Pairs = NDArray[np.intp]

# Two more markers have to agree before two labels are said to be exchanged.
FEWEST_TO_EXCHANGE = 4
# A renamed layout must fit ten times better than the one as labelled, and than the next renaming.
RENAMED_BETTER = 10.0
# Layouts of up to seven markers are tried in every order (5040), larger ones two labels at a time.
MOST_FOR_ALL_ORDERS = 7
_FRAMES_TO_COMPARE = 5
# Below this a layout as labelled is right whatever its noise: target.toml is measured by hand.
LABELS_FIT_M = 5e-3


@dataclass(frozen=True, slots=True)
class Exchange:
    """Labels that stood at each other's places: the indices, and the frames they did."""

    markers: tuple[int, ...]
    frames: NDArray[np.intp]


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


def exchanged_for_some_frames(
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
