"""Bright dots of one camera: followed from frame to frame, and told apart by where they lie."""

from __future__ import annotations

from itertools import permutations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

REACH = 3.0  # times the usual step between frames: a dot leaves its prediction by less
LEAST_REACH = 0.01  # rays, about 10 px: a dot that stood still starts to move
LONGEST_GAP = 15  # frames a dot may be hidden, by a wire or a hand
MIRRORED = 0.1  # of what dots seen from above would leave: what is mirrored leaves a hundredth
LEAST_SHARE = 0.6  # of the frames: a dot hidden for longer is no dot of the platform


class Spots(NamedTuple):
    """Unnamed bright spots of a run.

    Attributes:
        frames: row of its frame, increasing, (m,).
        rays: (m, 2).
        covariances: (m, 2, 2).
    """

    frames: Ints
    rays: Array
    covariances: Array


def followed(spots: Spots, frames: int) -> Ints:
    """Spots linked into dots: index of each dot's spot in each frame, -1 where none, (dots, n).

    A dot is looked for where its last two places say; the nearest spot is taken by one dot only.

    Source:
        Blackman 1999, Design and Analysis of Modern Tracking Systems, sec. 6.4: nearest neighbour.
    """
    bounds = np.searchsorted(spots.frames, np.arange(frames + 1))
    tracks: list[dict[int, int]] = []
    for frame in range(frames):
        mine = list(range(int(bounds[frame]), int(bounds[frame + 1])))
        places = [_predicted(track, frame, spots.rays) for track in tracks]
        pairs = sorted(
            (float(np.linalg.norm(spots.rays[spot] - place)), k, spot)
            for k, (place, _) in enumerate(places)
            for spot in mine
        )
        for apart, k, spot in pairs:
            if spot in mine and frame not in tracks[k] and apart < places[k][1]:
                tracks[k][frame] = spot
                mine.remove(spot)
        tracks += [{frame: spot} for spot in mine]
        tracks = [one for one in tracks if len(one) > 5 or frame - max(one) < LONGEST_GAP]
    found = np.full((len(tracks), frames), -1, dtype=np.int64)
    for row, track in enumerate(tracks):
        found[row, list(track)] = list(track.values())
    return found[(found >= 0).mean(axis=1) > LEAST_SHARE]


def _predicted(track: dict[int, int], frame: int, rays: Array) -> tuple[Array, float]:
    """Where a dot should be, and how far from there it may be."""
    last = list(track)[-2:]
    here = rays[track[last[-1]]]
    if frame - last[-1] > LONGEST_GAP:
        return here, 0.0
    if len(last) < 2:
        return here, LEAST_REACH
    step = (here - rays[track[last[0]]]) / (last[1] - last[0])
    reach = max(LEAST_REACH, REACH * float(np.linalg.norm(step))) * (frame - last[-1]) ** 0.5
    return here + step * (frame - last[-1]), reach


def moving(dots: Ints, spots: Spots, wanted: int) -> Ints:
    """The dots that move, most first, at most as many as are wanted, (k, n).

    Source:
        Rousseeuw, Croux 1993, Alternatives to the median absolute deviation: robust spreads.
    """
    spreads = np.array([_spread(dot, spots) for dot in dots])
    if len(dots) <= wanted:
        return dots
    order = np.argsort(-spreads)[:wanted]
    return dots[np.sort(order)]


def _spread(dot: Ints, spots: Spots) -> float:
    rays = spots.rays[dot[dot >= 0]]
    return float(np.sqrt(np.sum(np.var(rays, axis=0))))


def named(dots: Ints, spots: Spots, points_m: Array, side: float) -> Ints:
    """The dots in the order of the points that they are, (k, n).

    By the similarity that leaves least over the middles of their ways. Of two, and wherever orders
    fit alike, the one that turns the platform least in the image is taken.

    Args:
        dots: as `followed` gives them, as many as there are points.
        spots: their places.
        points_m: on the platform, (k, 2).
        side: 1: seen from above.

    Source:
        Umeyama 1991, Least-squares estimation of transformation parameters, eqs. 40 to 43.
    """
    return dots[_ordered(dots, spots, points_m, side)[1]]


def side_of_dots(dots: Ints, spots: Spots, points_m: Array) -> float:
    """-1 where dots at known places are seen from below, as a mirror has them; else 1.

    Two dots, and others that are their own mirror image, do not show it: they count as seen from
    above.

    Args:
        dots: as `followed` gives them, as many as there are points.
        spots: their places.
        points_m: on the platform, (k, 2).

    Source:
        Umeyama 1991, Least-squares estimation of transformation parameters, eqs. 40 to 43.
    """
    if len(dots) <= 2:
        return 1.0
    above, below = (_ordered(dots, spots, points_m, side)[0] for side in (1.0, -1.0))
    return -1.0 if below < MIRRORED * above else 1.0


def _ordered(dots: Ints, spots: Spots, points_m: Array, side: float) -> tuple[float, list[int]]:
    """Share of the dots' spread that their best order leaves, and that order."""
    middles = np.array([spots.rays[dot[dot >= 0]].mean(axis=0) for dot in dots])
    there = (middles - middles.mean(axis=0)) * [1.0, -side]
    here = points_m - points_m.mean(axis=0)
    z_there, z_here = there @ [1.0, 1.0j], here @ [1.0, 1.0j]
    best: tuple[float, float, list[int]] = (np.inf, np.inf, list(range(len(dots))))
    for order in permutations(range(len(dots))):
        carried = np.vdot(z_here, z_there[list(order)]) / np.vdot(z_here, z_here)
        left = float(np.sum(np.abs(z_there[list(order)] - carried * z_here) ** 2))
        share = left / float(np.sum(np.abs(z_there) ** 2))
        score = share + 1e-3 * abs(float(np.angle(carried))) / np.pi
        if score < best[0]:
            best = (score, share, list(order))
    return best[1:]
