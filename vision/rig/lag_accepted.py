"""Cameras that were started apart: whole seconds are found before anything is fused."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.rotation import invert
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.look.follow import REPEATED
from freeswing.vision.rig.gross_faults import stand_elsewhere
from freeswing.vision.rig.lag_search import OwnTrack, Pair, pair_of, sigmas_more

Array = NDArray[np.float64]

REACH_FRAMES = 0.5
"""Smaller lags are left to the adjustment of the clocks, which is exact that near."""
SURE_SIGMAS = 4.0
"""A start is believed when frame for frame any other misses by so many deviations more; one is
looked for when as stamped poses do. 0.7 s of a swing of 0.7 s a period leave 4 mm at 0.2 m."""
_LEAST_COMPARED = 20  # frames: the deviation of their differences is then good to a sixth
_SAME_START_S = 0.005
"""Starts that end so near are one: they were frames apart, and the clocks were put right."""
IN_EARNEST = 3.0
"""Starts that leave poses no more times as far apart as the best are tried with everything free."""
MOST_TRIED = 10


@dataclass(frozen=True, slots=True)
class Aligned:
    """Cameras with clocks good to a fraction of a frame.

    Attributes:
        lags_s: to be added to their clocks, (n_c,).
        pairs: by index of the first and the second camera.
        remarks: which camera was started when, and how sure that is.
    """

    lags_s: Array
    pairs: dict[tuple[int, int], Pair]
    remarks: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Missed:
    """How far the second camera is from what both agree on.

    Attributes:
        size_px: beyond the pixels' noise.
        squares_px2: mean square of each of its frames that both could see, by frame number.
        offset_s: between the clocks once they were put right.
    """

    size_px: float
    squares_px2: dict[int, float]
    offset_s: float = 0.0


Misfit = Callable[[CameraViews, CameraViews], Missed]
"""Of two cameras, clocks and rolling shutters free to be put right."""


def aligned(views: Sequence[CameraViews], reference: int, misfit: Misfit) -> Aligned:
    """Every camera beside one whose clock is known already, from the reference on.

    A swing nearly repeats itself, and rolling shutters bend what one camera sees: starts that fit
    nearly as well as the best are all tried in earnest.

    Raises:
        DataError: when two starts fit alike and none would not.
    """
    tracks = [own_track(view) for view in views]
    current = list(views)
    lags = np.zeros(len(views))
    pairs: dict[tuple[int, int], Pair] = {}
    remarks = []
    placed = [reference]
    while len(placed) < len(views):
        left = [k for k in range(len(views)) if k not in placed]
        found = _next(views, tracks, lags, placed, left)
        if found is None:
            break
        known, new, pair = found
        pairs[known, new] = pair
        placed.append(new)
        step = min(tracks[known].step_s, tracks[new].step_s)
        if abs(pair.lag_s) < REACH_FRAMES * step or not _needed(pair):
            continue
        if stand_elsewhere(pair):
            continue  # no start is right with such cameras, and pixels tell of none
        lag, best_px, rival_px, sure = _chosen(pair, current[known], views[new], misfit)
        if abs(lag) < REACH_FRAMES * step:
            continue  # as stamped after all
        here, there = views[new].camera.name, views[known].camera.name
        if sure < SURE_SIGMAS:
            raise DataError(
                f"cameras {there} and {here} were started apart, and the swing does not tell by "
                f"how much: {lag:+.3f} s leaves {best_px:.3f} px, another start {rival_px:.3f} px. "
                "Record the release too, or stamps of one clock"
                + _suspects((views[known], views[new]))
            )
        lags[new] = lag
        current[new] = later(views[new], lag)
        remarks.append(
            f"{here}: its clock is {lag:+.3f} s from {there}'s: they then disagree by "
            f"{best_px:.3f} px, next best start {_px(rival_px)} (as stamped poses are "
            f"{_mm(pair.at_zero_m)} apart)"
        )
    return Aligned(lags, pairs, tuple(remarks))


def _suspects(views: Sequence[CameraViews]) -> str:
    """What else leaves no start that fits, as far as what is seen points to it."""
    copies = {v.camera.name: int(np.sum(v.status == REPEATED)) for v in views}
    repeated = " and ".join(f"{name} repeats {n} frames" for name, n in copies.items() if n)
    if not repeated:
        return (
            ". Where every start leaves more than a tenth of a pixel, frames of one were lost "
            "while its stamps were counted on, or the cameras filmed different swings"
        )
    return (
        f". {repeated}, as a recorder does that falls behind: where every start leaves more than a "
        "tenth of a pixel, frames were lost besides while stamps were counted on. Put the frames' "
        "own times beside the videos (a csv with frame,t_s each)"
    )


def _chosen(
    pair: Pair, known: CameraViews, new: CameraViews, misfit: Misfit
) -> tuple[float, float, float, float]:
    """The best lag, its misfit and the next best's in px, and how many deviations are between."""
    most_m = IN_EARNEST * pair.decided_m
    lags = [pair.lag_s, *([0.0] if pair.at_zero_m < most_m else [])]
    lags += [lag for lag, miss_m in pair.rivals if miss_m < most_m]
    tried = [misfit(known, later(new, lag)) for lag in lags[:MOST_TRIED]]
    order = sorted(range(len(tried)), key=lambda k: tried[k].size_px)
    best = tried[order[0]]
    others = [tried[k] for k in order[1:]]
    rivals = [one for one in others if abs(one.offset_s - best.offset_s) > _SAME_START_S]
    sure = min((deviations_apart(best, rival) for rival in rivals), default=float("inf"))
    next_px = min((rival.size_px for rival in rivals), default=float("inf"))
    return lags[order[0]], best.size_px, next_px, sure


def deviations_apart(best: Missed, rival: Missed) -> float:
    """By how many deviations the rival misses more, over the frames that both compared.

    Both look at the same corners, so that what their noise does cancels in each frame's difference.
    Starts without common frames are held against each other by the logarithm of their variances,
    two numbers a frame, since the errors of one frame's corners are much alike.
    """
    if not np.isfinite(rival.size_px):
        return float("inf")
    both = sorted(best.squares_px2.keys() & rival.squares_px2.keys())
    if len(both) >= _LEAST_COMPARED:
        theirs, own = (np.array([one.squares_px2[k] for k in both]) for one in (rival, best))
        return sigmas_more(theirs, own)
    counts = (max(len(one.squares_px2), 1) for one in (best, rival))
    spread = np.sqrt(sum(1.0 / count for count in counts))
    return float(2.0 * np.log(rival.size_px / best.size_px) / spread)


def own_track(view: CameraViews) -> OwnTrack:
    """The platform as the camera alone saw it."""
    times, rotations, positions = [np.zeros(0)], [np.zeros((0, 3, 3))], [np.zeros((0, 3))]
    stamps = view.middle_times()
    for first, piece in view.pieces():
        mine = np.isfinite(piece.poses).all(axis=1) & np.isfinite(piece.stamps_s)
        times.append(stamps[first : first + len(mine)][mine])
        rotations.append(piece.poses[mine, :9].reshape(-1, 3, 3))
        positions.append(piece.poses[mine, 9:])
    at = np.concatenate(times)
    order = np.argsort(at, kind="stable")
    order = order[np.concatenate([[True], np.diff(at[order]) > 0.0])[: len(order)]]
    return OwnTrack(at[order], np.concatenate(rotations)[order], np.concatenate(positions)[order])


def _next(
    views: Sequence[CameraViews],
    tracks: Sequence[OwnTrack],
    lags: Array,
    placed: Sequence[int],
    left: Sequence[int],
) -> tuple[int, int, Pair] | None:
    """The first camera that shares motion with one that is placed."""
    for known in placed:
        first = replace(tracks[known], times_s=tracks[known].times_s + lags[known])
        for new in left:
            T_known_new = views[known].camera.T_camera_base @ invert(
                views[new].camera.T_camera_base
            )
            pair = pair_of(first, tracks[new], T_known_new)
            if pair is not None:
                return known, new, pair
    return None


def _needed(pair: Pair) -> bool:
    """Whether the records do not fit as they are stamped."""
    return pair.at_zero_sigmas > SURE_SIGMAS


def later(view: CameraViews, lag_s: float) -> CameraViews:
    """The camera with a clock that many seconds later."""
    camera = view.camera
    return view.believed(replace(camera, clock_offset_s=camera.clock_offset_s + float(lag_s)))


def _px(misfit_px: float) -> str:
    return f"{misfit_px:.3f} px" if np.isfinite(misfit_px) else "far off"


def _mm(miss_m: float) -> str:
    return f"{1e3 * miss_m:.1f} mm" if np.isfinite(miss_m) else "never both seen, not"
