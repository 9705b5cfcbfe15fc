"""Clock offsets between cameras, coarse: the same board turns at the same time for everyone.

The angular speed of a rigid board does not depend on who looks at it, so each camera's own track
of it is slid over the others' until they agree. The bundle adjustment then refines the offsets
with the board's motion (`calib.board.motion_pieces`). A hand waves much the same way again and
again: a lag is believed where chance cannot make tracks so alike, and no other lag does as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.calib.camera.intrinsics import CameraStart
from freeswing.calib.camera.lens_models import Array
from freeswing.cdpr.rotation import log_rotation

MOST_OFFSET_S = 5.0  # recordings are started by hand within seconds
LEAST_OVERLAP = 20  # speeds: fewer correlate by chance
LEAST_CORRELATION = 0.8  # one board turns alike for all cameras, other motions of a hand do not
LEAST_SIGMAS = 5.0
"""Of Fisher's transformed correlation: some 500 independent lags are tried, and one of 4 deviations
turns up among them in 3 % of recordings, one of 5 in 0.03 %."""
CLEAR_SIGMAS = 3.0
"""By which a lag stands above any other more than `APART_STEPS` away."""
APART_STEPS = 3.0
LEAST_SPEED_PX_S = 20.0  # slower corners hardly tell a clock
LEAST_MOVING = 8  # views a camera: fewer do not tell its clock
_MOST_GAP = 2.5  # usual steps: over a longer gap a speed is a mean of something else


@dataclass(frozen=True, slots=True)
class CoarseClocks:
    """When each camera was started.

    Attributes:
        offsets_s: of each camera's clock against the first camera's, zero where not known, (n_c,).
        unknown: cameras of which neither the board nor agreement as stamped tells it, by index.
    """

    offsets_s: Array
    unknown: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Lag:
    """The best lag of two tracks.

    Attributes:
        lag_s: to be added to the second's stamps.
        correlation: of the speeds there.
        sigmas: by how many deviations that is more than chance.
        clear: by how many it is above the best of other lags.
        as_stamped: the correlation without a lag, 0 where the tracks do not overlap.
    """

    lag_s: float = 0.0
    correlation: float = 0.0
    sigmas: float = 0.0
    clear: float = 0.0
    as_stamped: float = 0.0

    @property
    def is_believed(self) -> bool:
        """Whether a clock may be set by it."""
        return (
            self.correlation > LEAST_CORRELATION
            and self.sigmas > LEAST_SIGMAS
            and self.clear > CLEAR_SIGMAS
        )


def coarse_clocks(starts: tuple[CameraStart, ...], stamps_s: tuple[Array, ...]) -> CoarseClocks:
    """Offsets of the cameras' clocks, as far as the board tells them.

    Args:
        starts: every camera on its own, with its board poses.
        stamps_s: each camera's own stamp of each of its views.
    """
    tracks = [_speeds(start, stamps) for start, stamps in zip(starts, stamps_s, strict=True)]
    offsets = np.zeros(len(starts))
    placed, as_stamped = {0}, {0}
    while len(placed) < len(starts):
        lags = [
            (known, new, _best_lag(tracks[known], tracks[new]))
            for known in sorted(placed)
            for new in range(len(starts))
            if new not in placed
        ]
        as_stamped |= {new for _, new, lag in lags if lag.as_stamped > LEAST_CORRELATION}
        found = [(lag.correlation, -new, known, lag) for known, new, lag in lags if lag.is_believed]
        if not found:
            break
        _, new, known, lag = max(found, key=lambda one: one[:2])
        offsets[-new] = offsets[known] + lag.lag_s
        placed.add(-new)
    return CoarseClocks(offsets, tuple(sorted(set(range(len(starts))) - placed - as_stamped)))


def _speeds(start: CameraStart, stamps: Array) -> tuple[Array, Array]:
    """Stamps midway between neighbouring views, and the board's angular speed there in rad/s."""
    order = np.argsort(stamps)
    times, turns = stamps[order], start.T_camera_boards[order, :3, :3]
    step = np.diff(times)
    if len(step) < LEAST_OVERLAP or not np.isfinite(step).all():
        return np.zeros(0), np.zeros(0)
    angle = np.linalg.norm(log_rotation(turns[1:] @ np.swapaxes(turns[:-1], 1, 2)), axis=1)
    near = step < _MOST_GAP * np.median(step)
    return (times[1:] - 0.5 * step)[near], (angle / step)[near]


def _best_lag(known: tuple[Array, Array], new: tuple[Array, Array]) -> Lag:
    """Where two tracks of speed correlate most.

    Neighbouring speeds are much alike, so that n of them count as n (1 - p) / (1 + p), p the
    product of both tracks' correlations with themselves a sample later.

    Source:
        Bartlett 1935, Some aspects of the time-correlation problem; Fisher 1921 for the
        transformation by which correlations have deviations of 1 / sqrt(n - 3).
    """
    if len(known[0]) < LEAST_OVERLAP or len(new[0]) < LEAST_OVERLAP:
        return Lag()
    step = float(np.median(np.diff(known[0])))
    lags, sizes, counts = [], [], []
    for lag in np.arange(-MOST_OFFSET_S, MOST_OFFSET_S, 0.5 * step):
        at = new[0] + lag
        inside = (at > known[0][0]) & (at < known[0][-1]) & (_gap(known[0], at) < 1.5 * step)
        if inside.sum() < max(LEAST_OVERLAP, 0.3 * len(at)):
            continue
        lags.append(float(lag))
        sizes.append(_correlation(np.interp(at[inside], *known), new[1][inside]))
        counts.append(int(inside.sum()))
    if not lags:
        return Lag()
    alike = max(_own_correlation(known[1]), 0.0) * max(_own_correlation(new[1]), 0.0)
    own = np.maximum(np.array(counts) * (1.0 - alike) / (1.0 + alike) - 3.0, 0.0)
    heights = np.arctanh(np.clip(sizes, -1.0 + 1e-9, 1.0 - 1e-9))
    best = int(np.argmax(np.round(sizes, 6) - 1e-7 * np.abs(lags)))  # of equal ones the smaller
    others = np.abs(np.array(lags) - lags[best]) > APART_STEPS * step
    rival = float(np.max(heights[others], initial=0.0))
    scale = float(np.sqrt(own[best]))
    return Lag(
        lags[best],
        sizes[best],
        float(heights[best]) * scale,
        (float(heights[best]) - rival) * scale / np.sqrt(2.0),
        max(s for s, lag in zip(sizes, lags, strict=True) if abs(lag) < step)
        if min(np.abs(lags)) < step
        else 0.0,
    )


def _correlation(a: Array, b: Array) -> float:
    a, b = a - a.mean(), b - b.mean()
    return float(a @ b / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-12))


def _own_correlation(speeds: Array) -> float:
    """Of a track with itself a sample later."""
    return _correlation(speeds[1:], speeds[:-1])


def _gap(times: Array, at: Array) -> Array:
    """Distance in time between the samples around each instant."""
    after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
    return times[after] - times[after - 1]


def board_moves(speed_px_s: Array, camera: np.ndarray, count: int) -> bool:
    """Whether every camera has enough views of a board in smooth motion to tell its time."""
    moving = np.bincount(camera, speed_px_s > LEAST_SPEED_PX_S, count)
    return bool(moving.min() >= LEAST_MOVING)
