"""Coordinates as a camera from above has them: of some point, from a zero that nobody knows.

Such a film shows how far a point of the platform moves and turns, along the platform's axes at
rest; where rest is it tells by the swing alone. The point is where target.toml has the tags against
P, which a person measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.cdpr.rotation import angle_rate_matrix, matrix_from_angles
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown

ZERO, PLACE = "zero", "seen_place"
ZERO_STD = np.array([0.02, 0.02, 0.02, 0.1, 0.1, 0.1])  # of a mean over few periods of a swing
PLACE_STD_M = np.array([1e-3, 1e-3, 5e-3])  # of a tag against P: measured by a ruler, glued flat


def zero_blocks(places: Mapping[int, Array], runs: int) -> list[Unknown]:
    """The zero of every run, and the point that is seen; none where nothing was seen so.

    Args:
        places: the point by every coordinate (its place in the pose) that any run has so.
        runs: how many.
    """
    if not places:
        return []
    prior = Gaussian(np.zeros(6), ZERO_STD, "mean of a swing")
    estimated = np.isin(np.arange(6), list(places))
    mean = next(iter(places.values()))
    told = Gaussian(mean, PLACE_STD_M, "target.toml")
    return [
        Unknown(ZERO, np.zeros((runs, 6)), 0.1 * ZERO_STD, prior, estimated, each_run=True),
        Unknown(PLACE, np.array(mean), PLACE_STD_M, told, _shown(list(places))),
    ]


def _shown(coordinates: Sequence[int]) -> Array:
    """Yaw alone is that of every point."""
    return np.full(3, any(one < 3 for one in coordinates))


def from_rest(coordinate: int, zetas: Array, rest: Array, values: Mapping[str, Array]) -> Array:
    """What the camera reads along poses (n, 6), (n,).

    Source:
        Goldstein, Poole, Safko 2002, Classical Mechanics, sec. 4.9: a body's point.
    """
    read = zetas[:, coordinate] - rest[coordinate] + values[ZERO][coordinate]
    if coordinate < 3:
        turned = matrix_from_angles(zetas[:, 3:]) - matrix_from_angles(rest[3:])
        read = read + turned[:, coordinate] @ values[PLACE]
    return np.asarray(read)


def from_rest_slope(
    coordinate: int, zetas: Array, rest: Array, values: Mapping[str, Array]
) -> tuple[Array, dict[str, Array]]:
    """Its slopes by the pose (n, 6), and by its own blocks.

    Source:
        Goldstein, Poole, Safko 2002, Classical Mechanics, sec. 4.9: d(R p) = omega x R p.
    """
    slope, zero = np.zeros(zetas.shape), np.zeros(zetas.shape)
    slope[:, coordinate] = zero[:, coordinate] = 1.0
    own = {ZERO: zero}
    if coordinate < 3:
        turns = matrix_from_angles(zetas[:, 3:])
        axes = np.swapaxes(angle_rate_matrix(zetas[:, 3:]), 1, 2)  # a row an angle
        slope[:, 3:] += np.cross(axes, (turns @ values[PLACE])[:, None])[:, :, coordinate]
        own[PLACE] = (turns - matrix_from_angles(rest[3:]))[:, coordinate]
    return slope, own
