"""The time in which one of several cameras recorded alone: its poses are left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import CameraViews

LEAST_BY_TWO = 0.5  # a swing's poses that are left must be most of them, or alone is all there is


def recorded_by_two(poses: Poses, views: Sequence[CameraViews]) -> tuple[Poses, tuple[str, ...]]:
    """The poses without those of the time in which one of several cameras recorded alone.

    One camera's distances differ from those of two by more than its noise, so that the platform
    seems to step where the other begins. What is hidden from a camera now and then is kept, and so
    is everything where the others recorded less than half.
    """
    times = [view.middle_times() for view in views]
    spans = [(np.nanmin(own), np.nanmax(own)) for own in times if np.isfinite(own).any()]
    if len(spans) < 2:
        return poses, ()
    beat = float(np.median(np.diff(poses.times_s))) if len(poses.times_s) > 1 else 0.0
    at = poses.times_s
    cameras = sum((at > low - 0.6 * beat) & (at < high + 0.6 * beat) for low, high in spans)
    both = poses.known & (np.asarray(cameras) >= 2)
    alone = int(poses.known.sum() - both.sum())
    if not alone or both.sum() < LEAST_BY_TWO * poses.known.sum():
        return poses, ()
    return replace(poses, known=both), (
        f"{alone} of {int(poses.known.sum())} samples were recorded by one camera alone, before "
        "others were started or after they ended: left out",
    )
