"""Tracked runs as they stand on disk: cameras as found, trajectory, sightings and recordings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.recordings import Recording
from freeswing.calib.camera.camera import Camera
from freeswing.calib.tags.base_tags import SurveyedTag
from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.measured.target import Target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.rotation import exp_rotation
from freeswing.vision.fuse.tag_layout import with_layout
from freeswing.vision.look.pieces import Piece, load_piece
from freeswing.vision.look.sightings import collect_sightings
from freeswing.vision.look.target_check import examined_watch
from freeswing.vision.look.tied_tags import tied_watch
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.rig.rig_step import Finding
from freeswing.vision.track_session import RecordedRun, run_recordings, sightings_folder

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TrackedCamera:
    """One camera of a run.

    Attributes:
        camera: with its clock, line time and pose as tracking found them.
        recording: its frames.
        pieces: its sightings.
        lost: frames after which others were lost while the stamps were counted on, and the
            seconds that these took.
        rate: by how much longer its stamps take than those of most, and the stamp that stays.
    """

    camera: Camera
    recording: Recording
    pieces: tuple[Path, ...]
    lost: tuple[tuple[float, float], ...] = ()
    rate: tuple[float, float] = (0.0, 0.0)

    def frames(self) -> Iterator[tuple[Piece, int]]:
        """The piece and the row in it of every frame, in order, with its stamp put right.

        Tracking leaves out frames that may lie on either side of lost ones; here they keep the
        stamp that they have by the likeliest place, which may be off by what was lost.
        """
        for path in self.pieces:
            piece = load_piece(path)
            later = sum((gap_s * (piece.numbers > after) for after, gap_s in self.lost), 0.0)
            stamps = piece.stamps_s + later
            rate, about = self.rate
            piece = replace(piece, stamps_s=stamps - rate * (stamps - about))
            for row in range(len(piece.numbers)):
                yield piece, row


@dataclass(frozen=True, slots=True)
class TrackedRun:
    """A run: what was looked for, the trajectory, and the cameras."""

    name: str
    watch: Watch
    trajectory: Trajectory
    cameras: tuple[TrackedCamera, ...]


@dataclass(frozen=True, slots=True)
class FoundCameras:
    """What tracking found of a session's cameras and tags.

    Attributes:
        seen: names of the cameras of each run.
        findings: of each run.
        corners_platform_m: of all tags where they were refined, (tags, 4, 3), else None.
    """

    seen: Mapping[str, tuple[str, ...]]
    findings: Mapping[str, tuple[Finding, ...]]
    corners_platform_m: Array | None = None

    def on(self, run: str, camera: str) -> tuple[Finding, ...]:
        """The findings on one camera in one run."""
        return tuple(one for one in self.findings.get(run, ()) if one.camera == camera)


def tracked_run(
    run: RecordedRun,
    cameras: Sequence[Camera],
    target: Target,
    found: FoundCameras,
    *,
    results: Path,
    base_tags: Iterable[SurveyedTag] = (),
    frame_rate_hz: float | None = None,
) -> TrackedRun:
    """A run after `track_session` with the same arguments, and what that found.

    Raises:
        DataError: where it has not been tracked.
    """
    csv = results / "tracks" / f"{run.name}.csv"
    if not csv.is_file():
        raise DataError(f"run {run.name}: {csv} is not there; run freeswing track first")
    recordings = run_recordings(run, cameras)
    watch, _ = tied_watch(Watch.of(target, base_tags), results / "calibration.json")
    watch, _ = examined_watch(watch, recordings)
    seen = []
    for camera, recording in recordings:
        folder = sightings_folder(results, run.name)
        paths = collect_sightings(folder, camera, watch, recording, frame_rate_hz)
        findings = found.on(run.name, camera.name)
        own = as_found(camera, findings)
        lost, rate = lost_by(findings), rate_by(findings)
        seen.append(TrackedCamera(own, recording, tuple(paths), lost, rate))
    if found.corners_platform_m is not None:
        watch = with_layout(watch, found.corners_platform_m)
    return TrackedRun(run.name, watch, read_trajectory(csv), tuple(seen))


def lost_by(findings: Sequence[Finding]) -> tuple[tuple[float, float], ...]:
    """After which frames of a camera others were lost, and the seconds that these took."""
    told = [
        {name: value for name, value, _ in finding.parameters}
        for finding in findings
        if finding.effect == "lost_frames"
    ]
    return tuple((one["after_frame"], one["gap_s"]) for one in told)


def rate_by(findings: Sequence[Finding]) -> tuple[float, float]:
    """By how much longer a camera's stamps take, and about which stamp; zero where alike."""
    for finding in findings:
        if finding.effect == "clock_rate":
            told = {name: value for name, value, _ in finding.parameters}
            return told["rate"], told["about_s"]
    return 0.0, 0.0


def as_found(camera: Camera, findings: Sequence[Finding]) -> Camera:
    """A calibrated camera with what was found on it."""
    for finding in findings:
        told = {name: value for name, value, _ in finding.parameters}
        if finding.effect == "clock_offset":
            offset = camera.clock_offset_s + told["offset_s"]
            camera = replace(camera, clock_offset_s=offset)
        elif finding.effect == "rolling_shutter":
            camera = replace(camera, line_time_s=camera.line_time_s + told["line_time_s"])
        elif finding.effect == "camera_moved":
            turn = np.array([told[f"rotation_{axis}_rad"] for axis in "xyz"])
            shift = np.array([told[f"shift_{axis}_m"] for axis in "xyz"])
            pose = camera.T_camera_base.copy()
            place = camera.position_base_m + shift
            pose[:3, :3] = exp_rotation(turn) @ pose[:3, :3]
            pose[:3, 3] = -pose[:3, :3] @ place
            camera = replace(camera, T_camera_base=pose)
    return camera
