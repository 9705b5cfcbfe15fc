"""One run, from its cameras' sightings to its trajectory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.vision.fuse.calibration_share import (
    CalibrationNoise,
    RunShare,
    run_share,
    share_instants,
)
from freeswing.vision.fuse.found_share import FoundTimes, widened_by_found
from freeswing.vision.fuse.fuse_cameras import Fit, free_of
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.fuse.tag_layout import LayoutSums, layout_sums
from freeswing.vision.look.follow import STATUS_NAMES, USED
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.recorded_alone import recorded_by_two
from freeswing.vision.rig.correct_rig import Corrected, correct_rig
from freeswing.vision.rig.rig_step import Finding
from freeswing.vision.settings import Settings

Array = NDArray[np.float64]

PROVENANCE = "cameras"
LEFT_OUT_MOSTLY = 0.5
"""Of a camera's frames. Misread or half hidden tags are left out now and then; what is wrong with
the target stays."""


class PlatformCauses(Protocol):
    """Causes of the platform's own that put all poses of all runs wrong together."""

    def __call__(
        self, poses: Poses, views: Sequence[CameraViews], watch: Watch, chosen: NDArray[np.int64]
    ) -> Array:
        """What one deviation of each does to the chosen poses, (n, 6, m), m alike in all runs."""
        ...


@dataclass(frozen=True, slots=True)
class CameraCount:
    """One camera's frames in a run: seen, used, and rejected by reason."""

    name: str
    frames: int
    used: int
    rejected: dict[str, int]
    dropped: int


@dataclass(frozen=True, slots=True)
class RunTrack:
    """What became of a run; no trajectory where no pose is known."""

    name: str
    trajectory: Trajectory | None
    samples: int
    known: int
    rate_hz: float
    std_m: float
    std_rad: float
    calibration: RunShare | None
    cameras: tuple[CameraCount, ...]
    before: Fit
    after: Fit
    findings: tuple[Finding, ...]
    problems: tuple[str, ...]
    layout: LayoutSums


def track_run(
    name: str,
    sources: Sequence[tuple[Camera, Sequence[Path]]],
    watch: Watch,
    settings: Settings,
    noise: CalibrationNoise | None = None,
    platform: PlatformCauses | None = None,
) -> RunTrack:
    """Fuses a run's sightings and corrects the rig.

    The trajectory's covariances are those of its scatter. What the calibration's own uncertainty
    adds is common to the whole run and stated apart, where `noise` tells it; so is what `platform`
    tells of the platform's frame and points.
    """
    views = [CameraViews(camera, paths) for camera, paths in sources]
    counts = tuple(camera_count(view) for view in views)
    corrected = correct_rig(views, watch, settings.survey_std_m, look=settings.correct_rig)
    poses, lone = recorded_by_two(corrected.poses, corrected.views)
    found = _found_times(corrected.findings)
    poses = widened_by_found(poses, corrected.after, corrected.views, watch, found)
    known = int(poses.known.sum())
    shared = _shared(poses, corrected, watch, platform)
    share = run_share(poses, corrected.after, corrected.views, watch, noise, shared)
    deviations = np.sqrt(np.diagonal(poses.covariances, axis1=1, axis2=2))
    steps = np.diff(poses.times_s)
    return RunTrack(
        name,
        trajectory_of(poses, watch) if known else None,
        len(poses.times_s),
        known,
        float(1.0 / np.median(steps)) if len(steps) else float("nan"),
        _median(deviations[poses.known, :3]),
        _median(deviations[poses.known, 3:]),
        share,
        counts,
        corrected.before,
        corrected.after,
        corrected.findings,
        (*corrected.remarks, *lone, *_problems(counts, corrected.after, watch)),
        layout_sums(poses, corrected.after, corrected.views, watch),
    )


def _found_times(findings: Sequence[Finding]) -> dict[str, FoundTimes]:
    """What was found of each camera's times, by its name."""
    found: dict[str, FoundTimes] = {}
    for one in findings:
        told = {name: std for name, _, std in one.parameters}
        own = found.get(one.camera, FoundTimes())
        if one.effect == "clock_offset":
            found[one.camera] = replace(own, clock_std_s=told["offset_s"])
        elif one.effect == "rolling_shutter":
            found[one.camera] = replace(own, line_std_s=told["line_time_s"])
    return found


def _shared(
    poses: Poses, corrected: Corrected, watch: Watch, platform: PlatformCauses | None
) -> Array | None:
    """Causes that runs have in common beside the calibration's, (n, 6, m); None without any."""
    chosen = share_instants(poses)
    causes = [] if platform is None else [platform(poses, corrected.views, watch, chosen)]
    causes += [] if corrected.doubt is None else [corrected.doubt[chosen]]
    return np.concatenate(causes, axis=2) if causes else None


def trajectory_of(poses: Poses, watch: Watch) -> Trajectory:
    """The run's trajectory from its first to its last known pose, NaN in between.

    A target of one or two points gives the reference point alone: x, y, z.
    """
    have = np.flatnonzero(poses.known)
    span = slice(int(have[0]), int(have[-1]) + 1)
    if free_of(watch) == 3:
        return Trajectory(
            poses.times_s[span],
            ("x", "y", "z"),
            poses.positions_m[span],
            poses.covariances[span, :3, :3],
            PROVENANCE,
        )
    return Trajectory.from_poses(
        poses.times_s[span],
        poses.positions_m[span],
        poses.rotations[span],
        poses.covariances[span],
        PROVENANCE,
    )


def _median(values: Array) -> float:
    return float(np.median(values)) if values.size else float("nan")


def camera_count(view: CameraViews) -> CameraCount:
    """Frames of a recording by what became of them."""
    status = view.status
    rejected = {
        STATUS_NAMES[code]: int(np.sum(status == code))
        for code in range(len(STATUS_NAMES))
        if code != USED and np.any(status == code)
    }
    stamps = view.stamps_s[np.isfinite(view.stamps_s)]
    dropped = 0
    if len(stamps) > 2:
        steps = np.diff(stamps)
        step = float(np.median(steps))
        dropped = int(np.sum(np.maximum(np.round(steps / step) - 1, 0))) if step > 0.0 else 0
    return CameraCount(
        view.camera.name, len(status), int(np.sum(status == USED)), rejected, dropped
    )


def _problems(counts: Sequence[CameraCount], fit: Fit, watch: Watch) -> list[str]:
    """What a reader should know, in words."""
    said = count_problems(counts)
    for (camera, thing), told in fit.rejected.items():
        if told[0] >= 3:
            said.append(left_out_text(counts[camera], watch.name(thing), told))
    return said


def left_out_text(count: CameraCount, thing: str, told: tuple[int, int, float]) -> str:
    """What a camera's left out sightings of a thing say, by their number, first frame and px."""
    number, first, worst = told
    said = (
        f"{count.name}: {thing} left out {number} times, first in frame {first}, up to "
        f"{worst:.2f} px from where the other sightings put it"
    )
    mostly = number > LEFT_OUT_MOSTLY * count.used
    return f"{said}: its size or place is not as stated, or it came loose" if mostly else said


def count_problems(counts: Sequence[CameraCount]) -> list[str]:
    """Frames that showed nothing or are not there, in words."""
    said = []
    for count in counts:
        for reason, number in count.rejected.items():
            if number > 0.02 * max(count.frames, 1):
                said.append(f"{count.name}: {number} of {count.frames} frames: {reason}")
        if count.dropped:
            said.append(f"{count.name}: {count.dropped} frames missing between the stamps")
    return said
