"""Velocities and accelerations from the poses around each, over as long a stretch as poses bear."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.rotation import log_rotation

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

STRETCHES = (5, 7, 9, 11, 13)  # poses that give a motion
# Of claimed variances. What a quartic leaves of seven poses is their noise, which claims miss by a
# factor of two at most; a mode too fast for it leaves more.
MOST_DEVIATIONS = 6.0
# Of what seven poses leave: a quartic that bends away from longer stretches leaves more.
MOST_GROWTH = 1.3
_MOTIONS_AT_ONCE = 4000


def motion_of_poses(
    times_s: Array,
    positions: Array,
    rotations: Array,
    known: Mask,
    deviations: Array | None = None,
) -> Array:
    """Velocity, angular velocity and their rates, (n, 12), from the poses around each.

    A quartic by least squares, a parabola or a line where fewer are known. Five poses leave it
    all of their noise, which then carries whatever another camera saw between two instants to a
    wrong place; over a long stretch a fast mode would be smoothed away, and with it the very motion
    that is sought. The longest stretch is taken over which poses stay as near to the quartic as
    over a short one.

    Args:
        times_s: (n,).
        positions: (n, 3).
        rotations: (n, 3, 3).
        known: (n,).
        deviations: of positions and small rotations, as far as known, (6,); five poses without.

    Source:
        Fan, Gijbels 1996, Local Polynomial Modelling and Its Applications, ch. 3 and 4.
    """
    n = len(times_s)
    if n < 2:
        return np.zeros((n, 12))
    shortest = _motions(times_s, positions, rotations, known, STRETCHES[0])[0]
    if deviations is None or not np.isfinite(deviations).all():
        return shortest
    chosen, seven = shortest, np.full(2, np.inf)
    for stretch in STRETCHES[1:]:
        motions, squares = _motions(times_s, positions, rotations, known, stretch)
        if not len(squares):
            break
        usual = np.median(_by_kind(squares), axis=0)
        if not is_noise(usual, _by_kind(deviations**2), seven):
            break
        chosen, seven = motions, usual if stretch == STRETCHES[1] else seven
    return chosen


def is_noise(left: Array, claimed: Array, seven: Array) -> bool:
    """Whether what a quartic leaves of a stretch is the poses' noise.

    Args:
        left: mean squares, of positions and of rotations, (2,).
        claimed: variances that the poses claim, (2,).
        seven: what is left of seven poses, infinite where that is asked, (2,).

    Source:
        Fan, Gijbels 1996, Local Polynomial Modelling and Its Applications, sec. 4.2.
    """
    return bool(((left <= MOST_DEVIATIONS * claimed) & (left <= MOST_GROWTH * seven)).all())


def _by_kind(squares: Array) -> Array:
    """Sums over positions and over rotations, (..., 2)."""
    return np.asarray(squares).reshape(*squares.shape[:-1], 2, 3).sum(axis=-1)


def _motions(
    times_s: Array, positions: Array, rotations: Array, known: Mask, stretch: int
) -> tuple[Array, Array]:
    """Motions (n, 12), and mean squares left (m, 6) where the quartic has more poses than terms."""
    n = len(times_s)
    motions, squares = np.zeros((n, 12)), [np.zeros((0, 6))]
    for low in range(0, n, _MOTIONS_AT_ONCE):
        rows = np.arange(low, min(low + _MOTIONS_AT_ONCE, n))
        motions[rows], left = _motions_at(rows, times_s, positions, rotations, known, stretch)
        squares.append(left)
    return motions, np.concatenate(squares)


def _motions_at(
    rows: NDArray[np.int64],
    times_s: Array,
    positions: Array,
    rotations: Array,
    known: Mask,
    stretch: int,
) -> tuple[Array, Array]:
    """Motions of some rows, (k, 12), and what the quartic leaves there, (m, 6)."""
    n, motions = len(times_s), np.zeros((len(rows), 12))
    width = min(stretch, n)
    first = np.clip(rows - width // 2, 0, n - width)
    index = first[:, None] + np.arange(width)
    usable = known[index] & known[rows][:, None]
    relative = np.matmul(rotations[index], np.swapaxes(rotations[rows], 1, 2)[:, None])
    relative = np.where(usable[..., None, None], relative, np.eye(3))
    shifts = positions[index] - positions[rows][:, None]
    steps = np.concatenate([shifts, log_rotation(relative)], axis=-1)
    steps = np.where(usable[..., None], steps, 0.0)
    scale = float(np.median(np.diff(times_s))) * max(width // 2, 1)
    dt = (times_s[index] - times_s[rows][:, None]) / scale
    count = usable.sum(axis=1)
    squares = np.zeros((0, 6))
    for degree in (1, 2, 4):
        design = np.stack([dt**k for k in range(degree + 1)], axis=-1)
        design = np.where(usable[..., None], design, 0.0)
        normal = np.einsum("nwa,nwb->nab", design, design)
        enough = count > degree
        normal[~enough] = np.eye(degree + 1)
        found = np.linalg.solve(normal, np.einsum("nwa,nwc->nac", design, steps))
        motions[enough, :6] = found[enough, 1] / scale
        if degree > 1:
            motions[enough, 6:] = 2.0 * found[enough, 2] / scale**2
        spare = count > degree + 1
        if degree == 4 and spare.any():
            left = (steps - design @ found)[spare]
            squares = (left**2).sum(axis=1) / (count[spare] - degree - 1)[:, None]
    return motions, squares
