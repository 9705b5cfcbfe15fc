"""Normal equations of all views of a board: whitened, weighted rows, summed view by view.

What is compiled here holds `reprojection_kernels` in itself: change this file with that one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from freeswing.calib.camera.lens_kernels import WITH_SLOPES
from freeswing.calib.rig.kernel_inputs import Array, Estimate, Ints, ViewArrays
from freeswing.calib.rig.reprojection_kernels import (
    CLOCK,
    POSE,
    new_spare,
    view_of,
    view_rows,
)
from freeswing.cdpr.compiled.kernels import kernel


class Normal(NamedTuple):
    """Blocks of the normal equations, J'WJ and J'Wr of shared unknowns and boards; and the cost.

    Attributes:
        shared: (p, p).
        cross: (n_pieces, p, b).
        boards: (n_pieces, b, b).
        shared_slope: (p,).
        board_slopes: (n_pieces, b).
        cost: half the sum of squares, robust.
    """

    shared: Array
    cross: Array
    boards: Array
    shared_slope: Array
    board_slopes: Array
    cost: float


@kernel
def _whiten(factor: Array, block: Array, spare: Array) -> None:
    """Block <- factor @ block, for a lower triangle."""
    size = len(factor)
    for i in range(size - 1, -1, -1):
        spare[:] = 0.0
        for j in range(i + 1):
            f = factor[i, j]
            if f != 0.0:
                for c in range(block.shape[1]):
                    spare[c] += f * block[j, c]
        for c in range(block.shape[1]):
            block[i, c] = spare[c]


@kernel(forceinline=True)
def _weighted(
    views: ViewArrays, v: int, rows: Array, spare: Array, sigma: float, knee: float, cost: float
) -> tuple[int, float]:
    """Whitens and weights the groups of corners seen in view v, at the front of `rows`, in place.

    The residuals stand in the last column. Gives the number of rows in use and the cost with
    theirs, infinite where a corner cannot be seen from where the estimate puts it.
    """
    whitening = views.whitening[v]
    n_groups, size = whitening.shape[0], whitening.shape[1]
    last = rows.shape[1] - 1
    used = 0
    for group in range(n_groups):
        first = group * size
        if not math.isfinite(views.pixels[v, first // 2, 0]):
            continue
        block = rows[used : used + size]
        for i in range(size if used != first else 0):
            for j in range(rows.shape[1]):
                block[i, j] = rows[first + i, j]
        _whiten(whitening[group], block, spare)
        square = 0.0
        for i in range(size):
            square += block[i, last] ** 2
        error = math.sqrt(square) / sigma
        if not math.isfinite(error):
            return used, math.inf
        weight = 1.0 / sigma
        if error > knee:
            cost += knee * error - 0.5 * knee * knee
            weight *= math.sqrt(knee / error)
        else:
            cost += 0.5 * error * error
        for i in range(size):
            for j in range(rows.shape[1]):
                block[i, j] *= weight
        used += size
    return used, cost


@kernel(forceinline=True)
def _targets(first: int, own: int, shape_at: int, n_shape: int) -> Ints:
    """Where a view's columns before the board's stand among the shared unknowns."""
    target = np.empty(own + n_shape, dtype=np.int64)
    for j in range(own):
        target[j] = first + j
    for j in range(n_shape):
        target[own + j] = shape_at + j
    return target


@kernel(forceinline=True)
def _add_gram(gram: Array, target: Ints, piece: int, into: Normal) -> None:
    """Adds one view's rows' products to the blocks they belong to."""
    n_shared, last = len(target), len(gram) - 1
    width = last - n_shared
    for i in range(n_shared):
        a = target[i]
        into.shared_slope[a] += gram[i, last]
        for j in range(n_shared):
            into.shared[a, target[j]] += gram[i, j]
        for j in range(width):
            into.cross[piece, a, j] += gram[i, n_shared + j]
    for i in range(width):
        into.board_slopes[piece, i] += gram[n_shared + i, last]
        for j in range(width):
            into.boards[piece, i, j] += gram[n_shared + i, n_shared + j]


@kernel
def view_equations(
    views: ViewArrays, estimate: Estimate, sigma: Array, knee: float, shape_at: int, unknowns: int
) -> Normal:
    """Normal equations of all views, their cost infinite where one cannot be seen.

    Args:
        views: the board's.
        estimate: where everything is believed to be.
        sigma: each camera's noise, px, (n_c,).
        knee: of Huber's loss, for the length of a group's whitened residual over sigma.
        shape_at: first column of the shape among the shared unknowns.
        unknowns: p, how many shared ones there are.
    """
    n, width = len(estimate.boards.poses), 6 * (1 + estimate.boards.motions.shape[1])
    n_points = views.pixels.shape[1]
    shared, cross = np.zeros((unknowns, unknowns)), np.zeros((n, unknowns, width))
    boards, slope = np.zeros((n, width, width)), np.zeros(unknowns)
    found = Normal(shared, cross, boards, slope, np.zeros((n, width)), 0.0)
    residuals = np.zeros(2 * n_points)
    rows, spare, scratch = np.zeros((1, 1)), np.zeros(1), new_spare()
    n_shape = estimate.shape.modes.shape[2]
    cost = 0.0
    for v in range(len(views.camera)):
        c = views.camera[v]
        own = int(estimate.lenses.counts[c]) + POSE + CLOCK
        wide = own + n_shape + width + 1
        if wide != rows.shape[1]:
            rows, spare = np.zeros((2 * n_points, wide)), np.zeros(wide)
        view_rows(view_of(views, estimate, v), WITH_SLOPES, rows, residuals, scratch)
        for i in range(2 * n_points):
            rows[i, wide - 1] = residuals[i]
        used, cost = _weighted(views, v, rows, spare, float(sigma[c]), knee, cost)
        if not math.isfinite(cost):
            break
        some = rows[:used]
        target = _targets(int(estimate.lenses.first[c]), own, shape_at, n_shape)
        _add_gram(np.dot(some.T, some), target, views.piece[v], found)
    return Normal(shared, cross, boards, slope, found.board_slopes, cost)
