"""Cameras whose stamps were counted on over lost frames, with the stamps that these frames had."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.cdpr.files.documents import DataError
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.rig.lag_accepted import own_track
from freeswing.vision.rig.lag_search import OwnTrack
from freeswing.vision.rig.lost.lost_frames import Loss, Lost, counted, lost_frames
from freeswing.vision.rig.rig_step import Finding


def recounted(
    views: Sequence[CameraViews], *, by_tags: bool = True
) -> tuple[list[CameraViews], list[Finding], list[str]]:
    """Cameras with true stamps, what was found of each, and the same in words.

    Without tags no camera has poses of its own that would tell: that is said.

    Raises:
        DataError: naming the camera and the place, when frames were lost and it is not sure how
            many.
    """
    if not by_tags:
        return list(views), [], [*not_looked_for(views, "without tags")]
    now, findings, said = [], [], []
    for view in views:
        track = own_track(view)
        told, own, words = _put_right(view, track, lost_frames(track))
        now.append(told)
        findings += own
        said += words
    return now, findings, said


def not_looked_for(views: Sequence[CameraViews], why: str) -> tuple[str, ...]:
    """Which cameras' stamps may have been counted on over lost frames that nothing looks for."""
    stamps = [(view.camera.name, view.stamps_s[np.isfinite(view.stamps_s)]) for view in views]
    names = dict.fromkeys(name for name, own in stamps if counted(np.unique(own)) is not None)
    if not names:
        return ()
    return (
        f"{', '.join(names)}: stamps are even, and frames that were lost while they were counted "
        f"on are not looked for {why}. Where a recorder may have dropped some, put the frames' own "
        "times beside the video (CAMERA.csv with frame,t_s)",
    )


def _put_right(
    view: CameraViews, track: OwnTrack, lost: Lost
) -> tuple[CameraViews, list[Finding], list[str]]:
    if not (lost.losses or lost.unclear or lost.kinks):
        return view, [], []
    frame_at = {float(time): k for k, time in enumerate(view.middle_times())}
    frame_of = [frame_at[float(time)] for time in track.times_s]
    name = view.camera.name
    unsure = [loss for loss in lost.losses if len(loss.frames) != 1]
    if unsure:
        raise DataError(_unsure_text(view, [frame_of[loss.after] for loss in unsure], unsure))
    stamps, findings = view.stamps_s.copy(), []
    said = [_kink_text(view, frame_of[k]) for k in lost.kinks]
    for loss in lost.losses:
        after, count = frame_of[loss.after], loss.frames[0]
        stamps[after + 1 :] += count * track.step_s
        number = int(view.numbers[after])
        numbers = (("after_frame", float(number), 0.0), ("frames", float(count), 0.0))
        findings.append(
            Finding("lost_frames", name, (*numbers, ("gap_s", count * track.step_s, 0.0)))
        )
        said.append(
            f"{name}: {_frames(count)} lost after frame {number} ({view.stamps_s[after]:.2f} s) "
            "while the stamps were counted on, as the platform's own motion tells: later stamps "
            f"are put {count * track.step_s:.3f} s on"
        )
    if lost.unclear:
        left = [frame_of[k] for k in lost.unclear]
        stamps[left] = np.nan
        said.append(
            f"{name}: {len(left)} frames from frame {int(view.numbers[left[0]])} on may lie before "
            "or after such a gap: left out"
        )
    return view.restamped(stamps), findings, said


def _kink_text(view: CameraViews, after: int) -> str:
    return (
        f"{view.camera.name}: after frame {int(view.numbers[after])} ({view.stamps_s[after]:.2f} "
        "s) the platform goes on from where it was at another speed, as when it is knocked or let "
        "go: stamps are left as they are"
    )


def _unsure_text(view: CameraViews, places: Sequence[int], unsure: Sequence[Loss]) -> str:
    counts = unsure[0].frames
    many = f" ({counts[0]} to {counts[-1]})" if counts else ""
    more = f", and at {len(unsure) - 1} places more," if len(unsure) > 1 else ""
    return (
        f"camera {view.camera.name}: after frame {int(view.numbers[places[0]])} "
        f"({view.stamps_s[places[0]]:.2f} s){more} frames were lost while the stamps were counted "
        f"on, and the platform's motion does not tell how many{many}: put the frames' own times "
        f"beside the video ({view.camera.name}.csv with frame,t_s), or film again"
    )


def _frames(count: int) -> str:
    return f"{count} frames were" if count > 1 else "1 frame was"
