"""Clock offsets between cameras, coarse: the same board turns at the same time for everyone.

The angular speed of a rigid board does not depend on who looks at it, so each camera's own track
of it is slid over the others' until they agree. The bundle adjustment then refines the offsets
with the board's motion (`calib.board.board_motion`).
"""

from __future__ import annotations

import numpy as np

from freeswing.calib.camera.intrinsics import CameraStart
from freeswing.calib.camera.lens_models import Array
from freeswing.cdpr.rotation import log_rotation

MOST_OFFSET_S = 5.0  # recordings are started by hand within seconds
LEAST_OVERLAP = 20  # speeds: fewer correlate by chance
LEAST_CORRELATION = 0.8  # one board turns alike for all cameras, other motions of a hand do not
LEAST_SPEED_PX_S = 20.0  # slower corners hardly tell a clock
LEAST_MOVING = 8  # views a camera: fewer do not tell its clock
_MOST_GAP = 2.5  # usual steps: over a longer gap a speed is a mean of something else


def coarse_offsets_s(starts: tuple[CameraStart, ...], stamps_s: tuple[Array, ...]) -> Array:
    """Offset of each camera's clock against the first camera's, (n_cameras,).

    Zero for cameras that do not see the board turn together with one already placed.

    Args:
        starts: every camera on its own, with its board poses.
        stamps_s: each camera's own stamp of each of its views.
    """
    tracks = [_speeds(start, stamps) for start, stamps in zip(starts, stamps_s, strict=True)]
    offsets = np.zeros(len(starts))
    placed = {0}
    while len(placed) < len(starts):
        best = (LEAST_CORRELATION, 0.0, -1)
        for known in sorted(placed):
            for new in range(len(starts)):
                if new in placed:
                    continue
                correlation, lag = _best_lag(tracks[known], tracks[new])
                if correlation > best[0]:
                    best = (correlation, offsets[known] + lag, new)
        if best[2] < 0:
            break
        offsets[best[2]] = best[1]
        placed.add(best[2])
    return offsets


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


def _best_lag(known: tuple[Array, Array], new: tuple[Array, Array]) -> tuple[float, float]:
    """Highest correlation of two speed tracks, and the offset that has to be added to `new`."""
    if len(known[0]) < LEAST_OVERLAP or len(new[0]) < LEAST_OVERLAP:
        return 0.0, 0.0
    step = float(np.median(np.diff(known[0])))
    lags = np.arange(-MOST_OFFSET_S, MOST_OFFSET_S, 0.5 * step)
    # small shifts first, so that equal correlations choose the smaller offset
    lags = lags[np.argsort(np.abs(lags), kind="stable")]
    best = (0.0, 0.0)
    for lag in lags:
        at = new[0] + lag
        inside = (at > known[0][0]) & (at < known[0][-1]) & (_gap(known[0], at) < 1.5 * step)
        if inside.sum() < max(LEAST_OVERLAP, 0.3 * len(at)):
            continue
        a, b = np.interp(at[inside], *known), new[1][inside]
        a, b = a - a.mean(), b - b.mean()
        correlation = float(a @ b / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-12))
        if correlation > best[0] + 1e-6:
            best = (correlation, float(lag))
    return best


def _gap(times: Array, at: Array) -> Array:
    """Distance in time between the samples around each instant."""
    after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
    return times[after] - times[after - 1]


def board_moves(speed_px_s: Array, camera: np.ndarray, count: int) -> bool:
    """Whether every camera has enough views of a board in smooth motion to tell its time."""
    moving = np.bincount(camera, speed_px_s > LEAST_SPEED_PX_S, count)
    return bool(moving.min() >= LEAST_MOVING)
