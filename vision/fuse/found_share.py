"""What times of frames may still be off by, in a run's poses: clocks, line times, jitter.

A line time goes with the clock: what a recording tells best is when the middle of its picture was
taken. So a line time is off about the middle row, and a clock by what is left of its deviation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.measured.pose_errors import error_terms, fitted_terms
from freeswing.vision.fuse.calibration_share import pose_slopes, share_instants
from freeswing.vision.fuse.fuse_cameras import Fit
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.look.watched_target import Watch

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FoundTimes:
    """Deviations of what was found of a camera's times, zero where nothing was.

    Attributes:
        clock_std_s: of its clock, at the first row.
        line_std_s: of its line time.
    """

    clock_std_s: float = 0.0
    line_std_s: float = 0.0


def widened_by_found(
    poses: Poses,
    fit: Fit,
    views: Sequence[CameraViews],
    watch: Watch,
    found: Mapping[str, FoundTimes],
) -> Poses:
    """Poses whose covariances hold what found clocks and line times are off by.

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3: what is estimated apart
        adds its covariance through its slope.
    """
    known = np.flatnonzero(poses.known)
    if not found or not len(known) or not len(poses.covariances):
        return poses
    names = [f"{camera}.{entry}" for camera in found for entry in ("clock_offset_s", "line_time_s")]
    slopes = pose_slopes(poses, fit, views, watch, tuple(names))
    rows = {view.camera.name: 0.5 * view.camera.size_px[1] for view in views}
    causes = []
    for k, (camera, told) in enumerate(found.items()):
        by_clock, by_line = slopes[:, :, 2 * k], slopes[:, :, 2 * k + 1]
        middle = rows[camera] if told.clock_std_s > 0.0 else 0.0
        rest = max(told.clock_std_s**2 - (middle * told.line_std_s) ** 2, 0.0)
        causes += [told.line_std_s * (by_line - middle * by_clock), np.sqrt(rest) * by_clock]
    return _widened(poses, np.stack(causes, axis=2))


def widened_by_jitter(
    poses: Poses, fit: Fit, views: Sequence[CameraViews], watch: Watch, jitter_s: Array
) -> Poses:
    """Poses whose covariances hold what stamps that jitter put them off by.

    A late camera does not move a pose by its share of the way alone: two that look aslant at each
    other then meet at another distance.

    Args:
        poses: of a run.
        fit: how its sightings agree with them.
        views: its cameras.
        watch: what was looked for.
        jitter_s: deviation of each camera's stamps, one independent of the other, (n_c,).

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3: what is estimated apart
        adds its covariance through its slope.
    """
    if not jitter_s.any() or not poses.known.any() or not len(poses.covariances):
        return poses
    names = tuple(f"{view.camera.name}.clock_offset_s" for view in views)
    return _widened(poses, pose_slopes(poses, fit, views, watch, names) * jitter_s)


def _widened(poses: Poses, causes: Array) -> Poses:
    """The same with the scatter of causes that are told at `share_instants`, (n, 6, m)."""
    known = np.flatnonzero(poses.known)
    about = int(known[len(known) // 2])
    origin, turn = poses.positions_m[about], poses.rotations[about]

    def terms(chosen: NDArray[np.int64]) -> Array:
        places, turns = poses.positions_m[chosen], poses.rotations[chosen]
        return error_terms(places, turns, poses.motions[chosen, :6], origin, turn)

    fitted = fitted_terms(terms(share_instants(poses)), causes)
    off = np.einsum("nk,akm->nam", terms(known), fitted)
    covariances = poses.covariances.copy()
    covariances[known] += off @ np.swapaxes(off, 1, 2)
    return replace(poses, covariances=covariances)
