"""Recorded runs to trajectories: every camera followed, all fused.

The call that the command line makes:

    tracked = track_session(session.video_runs, read_cameras(session.cameras),
                            Watch.of(read_target(session.target), base_tags),
                            results=session.results, frame_rate_hz=session.frame_rate_hz,
                            workers=0, progress=console.progress)

`results/calibration.json`, where there is one, tells how far the calibration may shift the poses.
The call writes no result; it keeps each camera's sightings under `results/tracks/.sightings`, from
where one that was killed goes on.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from freeswing.calib.board.recordings import Recording, find_recordings
from freeswing.calib.camera.camera import Camera
from freeswing.calib.footage.first_frames import condition_of
from freeswing.calib.footage.frame_times import frame_times, needed
from freeswing.calib.footage.interlacing import torn_text
from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.system.progress import Progress
from freeswing.vision.fuse.calibration_share import CalibrationNoise, read_calibration_noise
from freeswing.vision.fuse.tag_layout import layout_change, never_seen, with_layout
from freeswing.vision.jobs import Job, run_jobs
from freeswing.vision.look.sightings import collect_sightings
from freeswing.vision.look.target_check import examined_watch
from freeswing.vision.look.tied_tags import tied_watch
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.settings import Settings
from freeswing.vision.track_run import RunTrack, track_run
from freeswing.vision.tracking_report import tracking_document

_LAYOUT_ROUNDS = 3
_NEVER = "seen in no run: hidden, or its id is another"
_FOLLOWING = 0.85  # share of the time that goes into the images


@dataclass(frozen=True, slots=True)
class Tracked:
    """What `track_session` gives.

    Attributes:
        document: the content of results/tracking.json.
        trajectories: of the runs in which the platform was seen, by name.
        refused: why they must not be used; the document explains it.
    """

    document: dict[str, Any]
    trajectories: dict[str, Trajectory]
    refused: str | None = None


class RecordedRun(Protocol):
    """What a run has to have: a name and the folder with one recording a camera."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def video(self) -> Path | None: ...  # noqa: D102


def track_session(
    runs: Sequence[RecordedRun],
    cameras: Sequence[Camera],
    watch: Watch,
    *,
    results: Path,
    frame_rate_hz: float | None = None,
    settings: Settings | None = None,
    workers: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Tracked:
    """Tracks all runs.

    Args:
        runs: with `name` and `video`; those without a video are left out.
        cameras: as calibrated.
        watch: what is on the platform, and the surveyed tags in the base.
        results: the session's results folder, of which it reads calibration.json and keeps
            sightings.
        frame_rate_hz: serves recordings without time stamps.
        settings: see `Settings`.
        workers: processes; 0 = one a core.
        executor: follows the recordings instead of them, such as a cluster's; it has to see the
            same files under the same names.
        progress: told a label and the fraction done.

    Raises:
        InputError: a recording is missing, unreadable or of another size than its camera.
    """
    settings = settings or Settings()
    filmed = [run for run in runs if run.video is not None]
    if not filmed:
        raise InputError("no run of the session has a video; there is nothing to track")
    pairs = [(run.name, run_recordings(run, cameras)) for run in filmed]
    remarks = {name: examined(found, frame_rate_hz) for name, found in pairs}
    for run in filmed:
        remarks[run.name] += unmatched(run, cameras)
    stated = watch.tag_corners_m
    watch, tied = tied_watch(watch, results / "calibration.json")
    watch, said = examined_watch(watch, pairs[0][1])
    remarks[pairs[0][0]] += [*tied, *said]
    jobs = [
        Job(
            f"{name} {camera.name}",
            collect_sightings,
            (sightings_folder(results, name), camera, watch, recording, frame_rate_hz),
        )
        for name, found in pairs
        for camera, recording in found
    ]
    paths = run_jobs(jobs, workers, _scaled(progress, 0.0, _FOLLOWING), executor)
    sources = _by_run(pairs, paths)
    told = _scaled(progress, _FOLLOWING, 1.0)
    noise = read_calibration_noise(results / "calibration.json", tied=not tied)
    tracks = _fuse(sources, watch, noise, settings, workers, told)
    layouts = [track.layout for track in tracks]
    remarks[pairs[0][0]] += [f"{name}: {_NEVER}" for name in never_seen(layouts, watch)]
    change = layout_change(layouts, watch).against(stated)
    if settings.refine_layout:
        for _ in range(_LAYOUT_ROUNDS):
            refined = layout_change([track.layout for track in tracks], watch)
            watch = with_layout(watch, refined.corners_m)
            tracks = _fuse(sources, watch, noise, settings, workers, told)
    tracks = [replace(t, problems=(*remarks[t.name], *t.problems)) for t in tracks]
    document = tracking_document(tracks, watch, change, refined=settings.refine_layout)
    known = {track.name: track.trajectory for track in tracks if track.trajectory is not None}
    return Tracked(document, known, empty_run(tracks))


def sightings_folder(results: Path, run: str) -> Path:
    """Where the sightings of a run's cameras are kept."""
    return results / "tracks" / ".sightings" / run


def run_recordings(run: RecordedRun, cameras: Sequence[Camera]) -> list[tuple[Camera, Recording]]:
    """The recordings of a run with their cameras.

    Raises:
        InputError: where none is named as a camera.
    """
    by_name = {camera.name: camera for camera in cameras}
    found = {r.name: r for r in find_recordings(run.video or Path())}
    known = [name for name in by_name if name in found]
    if not known:
        raise InputError(
            f"{run.video}: recordings of {', '.join(found)}, but cameras.toml knows "
            f"{', '.join(by_name)}: name the files as the cameras are named"
        )
    return [(by_name[name], found[name]) for name in known]


def unmatched(run: RecordedRun, cameras: Sequence[Camera]) -> list[str]:
    """Recordings that no camera has the name of, and cameras that have no recording in a run."""
    known = {camera.name for camera in cameras}
    found = {recording.name for recording in find_recordings(run.video or Path())}
    said = [
        f"{name}: its recording is not used, cameras.toml knows no camera of that name"
        for name in sorted(found - known)
    ]
    return said + [f"{name}: has no recording in this run" for name in sorted(known - found)]


def examined(found: Sequence[tuple[Camera, Recording]], frame_rate_hz: float | None) -> list[str]:
    """What a run's recordings say of their times that a reader should know.

    Raises:
        DataError: where a recording's frames are torn, or its stated rates contradict each other.
    """
    said = []
    for camera, recording in found:
        if condition_of(recording).is_torn:
            raise DataError(torn_text(recording))
        times = needed(frame_times(recording, frame_rate_hz), recording)
        said += [f"{camera.name}: {remark.text}" for remark in times.remarks if remark.is_warning]
    return said


def _by_run(
    pairs: Sequence[tuple[str, list[tuple[Camera, Recording]]]], paths: Sequence[list[Path]]
) -> list[tuple[str, tuple[tuple[Camera, tuple[Path, ...]], ...]]]:
    """Each run's cameras with their pieces."""
    sources, start = [], 0
    for name, found in pairs:
        mine = paths[start : start + len(found)]
        start += len(found)
        views = tuple((camera, tuple(p)) for (camera, _), p in zip(found, mine, strict=True))
        sources.append((name, views))
    return sources


def _fuse(
    sources: Sequence[tuple[str, tuple[tuple[Camera, tuple[Path, ...]], ...]]],
    watch: Watch,
    noise: CalibrationNoise | None,
    settings: Settings,
    workers: int,
    progress: Progress | None,
) -> list[RunTrack]:
    jobs = [
        Job(
            f"{name} fused",
            track_run,
            (name, views, watch, settings, noise),
        )
        for name, views in sources
    ]
    return run_jobs(jobs, workers, progress)


def _scaled(progress: Progress | None, low: float, high: float) -> Progress | None:
    if progress is None:
        return None
    return lambda label, share: progress(label, low + (high - low) * share)


def empty_run(tracks: Sequence[RunTrack]) -> str | None:
    """Says in which run the platform was not seen, None where it was in all."""
    empty = next((track for track in tracks if track.known == 0), None)
    if empty is None:
        return None
    why = empty.problems[0] if empty.problems else "the platform was not seen"
    return (
        f"run {empty.name}: no pose in {empty.samples} frames: {why}. "
        "Check target.toml (family, ids, sizes), the light and the focus"
    )
