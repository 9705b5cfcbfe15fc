"""Where a recorded board moves in one go: pieces of the recording, one smooth motion each.

A moving board is seen by every camera, and in a rolling shutter by every row, at another time.
Rather than carrying what was measured to a common instant, which makes the noise of neighbouring
frames one another's, the board's motion over a few frames is a polynomial and every corner is
predicted at its own time (`calib.rig.reprojection_kernels`); continuous-time calibration after
Furgale et al. (2013), with pieces in place of splines, so that the normal equations stay an arrow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.reprojection import Scene
from freeswing.calib.rig.views import Views
from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.rotation import exp_rotation, log_rotation, transform

DEGREE = 4
PIECE = DEGREE + 1
_START_DEGREE = 2
NONE, REST = -1, -2


@dataclass(frozen=True, slots=True)
class Timeline:
    """When the moments were, and which belong to one motion.

    Attributes:
        times_s: base time of each moment, (n_moments,).
        piece: piece of each moment, `NONE` for those that belong to none, `REST` for those at which
            what is seen rests, (n_moments,).
    """

    times_s: Array
    piece: np.ndarray


def timeline(times_s: Array, linked: np.ndarray) -> Timeline:
    """Cuts runs of moments into pieces of `PIECE`; what is left over belongs to none.

    A piece has as many moments as its motion has coefficients, so that the polynomial is near the
    truth around each of them even where frames are too slow for it in between.

    Args:
        times_s: rising, (n,).
        linked: whether the board moves on smoothly from a moment to the next, bool (n - 1,).
    """
    piece = np.full(len(times_s), -1)
    number = 0
    for run in np.split(np.arange(len(times_s)), np.flatnonzero(~linked) + 1):
        for first in range(0, len(run) - PIECE + 1, PIECE):
            piece[run[first : first + PIECE]] = number
            number += 1
    return Timeline(times_s, piece)


def in_pieces(scene: Scene, views: Views, line: Timeline) -> tuple[Scene, Views]:
    """The same board poses as motions of the pieces; views outside every piece are left out.

    Args:
        scene: one board pose a moment.
        views: the moments numbered as in `line`; lags from the moments' times.
        line: the moments' times and pieces.

    Raises:
        DataError: when no piece is left.
    """
    piece, at_rest = _with_rests(line)
    moments = np.unique(views.moment)
    present = piece[moments]
    counts = np.bincount(present[present >= 0], minlength=int(piece.max(initial=0)) + 1)
    whole = counts >= np.where(at_rest, 1, PIECE)
    if not (whole & ~at_rest).any():
        raise DataError(
            f"no {PIECE} frames on end show the board moving smoothly; film it without cuts"
        )
    views = views.select((piece[views.moment] >= 0) & whole[piece[views.moment]])
    _, number = np.unique(piece[views.moment], return_inverse=True)
    count = int(number.max()) + 1
    own = [np.unique(views.moment[number == k]) for k in range(count)]
    middles = np.array([0.5 * (line.times_s[m[0]] + line.times_s[m[-1]]) for m in own])
    scale = max(
        float(np.abs(line.times_s[m] - at).max()) for m, at in zip(own, middles, strict=True)
    )
    poses = np.zeros((count, 4, 4))
    motion = np.zeros((count, DEGREE, 6))
    for k, (moments, at) in enumerate(zip(own, middles, strict=True)):
        times = (line.times_s[moments] - at) / scale
        poses[k], motion[k, :_START_DEGREE] = _fitted(times, scene.T_base_boards[moments])
    lag = views.lag_s + line.times_s[views.moment] - middles[number]
    lag[line.piece[views.moment] == REST] = np.nan
    moved = replace(scene, T_base_boards=poses, motion=motion, motion_scale_s=scale)
    return moved, replace(views, piece=number, lag_s=lag)


def _with_rests(line: Timeline) -> tuple[np.ndarray, np.ndarray]:
    """Piece of each moment, those at rest pieces of their own, and which pieces are at rest."""
    piece = line.piece.copy()
    rests = np.flatnonzero(piece == REST)
    first = int(piece.max(initial=-1)) + 1
    piece[rests] = first + np.arange(len(rests))
    return piece, np.arange(first + len(rests)) >= first


def _fitted(times: Array, poses: Array) -> tuple[Array, Array]:
    """Pose at time 0 (4, 4) and the motion's first coefficients (degree, 6) by least squares."""
    middle = poses[len(poses) // 2]
    turns = log_rotation(poses[:, :3, :3] @ middle[:3, :3].T)
    degree = min(_START_DEGREE, len(times) - 1)
    powers = times[:, None] ** np.arange(degree + 1)
    values = np.concatenate([poses[:, :3, 3], turns], axis=1)
    found, *_ = np.linalg.lstsq(powers, values, rcond=None)
    pose = transform(exp_rotation(found[0, 3:]) @ middle[:3, :3], found[0, :3])
    motion = np.zeros((_START_DEGREE, 6))
    motion[:degree] = found[1:]
    return pose, motion


def linked(times_s: Array, smooth: np.ndarray, frame_s: float) -> np.ndarray:
    """Whether the board moves on smoothly from a moment to the next, bool (n - 1,).

    Across a cut neither of the two moments beside it has smooth neighbours.

    Args:
        times_s: rising, (n,).
        smooth: whether the moment and its two neighbours show one smooth motion, bool (n,).
        frame_s: time from a frame to the next.
    """
    return (np.diff(times_s) < 1.5 * frame_s) & (smooth[1:] | smooth[:-1])


def boards_at(scene: Scene, piece: np.ndarray, times_s: Array) -> Array:
    """T_base_board at times from the middles of pieces, both (n,), (n, 4, 4).

    Source:
        Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, ch. 2:
        rotation vectors; polynomials in them are plain algebra.
    """
    order = np.arange(1, scene.motion.shape[1] + 1)
    known = np.nan_to_num(times_s)  # a board at rest is where it is at any time
    powers = (known[:, None] / scene.motion_scale_s) ** order
    change = np.einsum("nj,nji->ni", powers, scene.motion[piece])
    poses = scene.T_base_boards[piece]
    turns = exp_rotation(change[:, 3:]) @ poses[:, :3, :3]
    return transform(turns, poses[:, :3, 3] + change[:, :3])
