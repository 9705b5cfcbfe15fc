"""`track --no-tags`: runs of a platform without tags to trajectories.

Its points come from the frames at rest, are found again in every frame, and go the way of markers:
one robust solve an instant of all cameras, with covariance.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.recordings import Image, Recording, find_recordings, read_frames
from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.measured.target import Untagged
from freeswing.cdpr.system.progress import Progress
from freeswing.vision.fuse.calibration_share import read_calibration_noise
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.fuse.tag_layout import layout_change
from freeswing.vision.jobs import Job, run_jobs
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.rig.correct_rig import correct_rig
from freeswing.vision.settings import Settings
from freeswing.vision.track_run import RunTrack, track_run
from freeswing.vision.track_session import (
    RecordedRun,
    Tracked,
    empty_run,
    run_recordings,
    sightings_folder,
    unmatched,
)
from freeswing.vision.tracking_report import tracking_document
from freeswing.vision.untagged.adjusted_points import bias_of_features, refined_points
from freeswing.vision.untagged.aligned_patches import overlap
from freeswing.vision.untagged.feature_bias import PlatformErrors
from freeswing.vision.untagged.pose_by_matches import collect_points
from freeswing.vision.untagged.rest_model import rest_model

Array = NDArray[np.float64]
Sources = list[tuple[str, tuple[tuple[Camera, tuple[Path, ...]], ...]]]

_FRAMES_AT_REST = 9  # averaged
_FRAMES_OF_A_SWING = 12  # to tell the platform from what stands behind it
_EVERY = 7
_ROUNDS = 2


def track_untagged(
    runs: Sequence[RecordedRun],
    cameras: Sequence[Camera],
    untagged: Untagged,
    *,
    results: Path,
    frame_rate_hz: float | None = None,
    settings: Settings | None = None,
    workers: int = 0,
    progress: Progress | None = None,
) -> Tracked:
    """Tracks all runs; what it writes and gives is that of `vision.track_session`.

    Args:
        runs: with `name` and `video`.
        cameras: as calibrated.
        untagged: what target.toml says of the platform.
        results: the session's results folder, where sightings are kept.
        frame_rate_hz: serves recordings without time stamps.
        settings: see `Settings`; there is no layout of tags to refine, points always are.
        workers: processes; 0 = one a core.
        progress: told a label and the fraction done.

    Raises:
        InputError: recordings, marks or images that cannot be used.
        DataError: the platform shows too few points, or the named ones do not fit.
    """
    settings = settings or Settings()
    filmed = [run for run in runs if run.video is not None]
    if not filmed:
        raise InputError("no run of the session has a video; there is nothing to track")
    pairs = [(run.name, run_recordings(run, cameras)) for run in filmed]
    if progress is not None:
        progress("the platform at rest", 0.0)
    model = rest_model(cameras, _rests(untagged, cameras), _swings(pairs[0][1]), untagged)
    watch = _watch(model.points_m)
    jobs = [
        Job(
            f"{name} {camera.name}",
            collect_points,
            (
                sightings_folder(results, name),
                camera,
                watch,
                model.seen[camera.name],
                model.patches,
                recording,
                frame_rate_hz,
            ),
        )
        for name, found in pairs
        for camera, recording in found
        if camera.name in model.seen
    ]
    paths = iter(run_jobs(jobs, workers, progress))
    sources: Sources = [
        (name, tuple((c, tuple(next(paths))) for c, _ in found if c.name in model.seen))
        for name, found in pairs
    ]
    rest = np.zeros((6, 6))
    for _ in range(_ROUNDS):
        points, rest = refined_points(_fused(sources, watch, settings), watch, model, cameras)
        watch = _watch(points)
    bias = bias_of_features(_fused(sources, watch, settings), watch, cameras)
    noise = read_calibration_noise(results / "calibration.json")
    frame = frame_of_platform(model.frame_covariance + rest, model.T_base_rest)
    errors = PlatformErrors(frame, bias)
    shared = max(overlap(seen.pixels) for seen in model.at_rest.values())
    tracks = [
        _grown(track_run(name, views, watch, settings, noise, errors), shared)
        for name, views in sources
    ]
    focal_px = float(np.mean([camera.focal_px.mean() for camera in cameras]))
    told = _how_well(len(model.points_m), errors, focal_px)
    remarks = {run.name: (told, *unmatched(run, cameras)) for run in filmed}
    tracks = [replace(t, problems=(*remarks[t.name], *t.problems)) for t in tracks]
    change = layout_change([track.layout for track in tracks], watch)
    document = tracking_document(tracks, watch, change, refined=False)
    known = {track.name: track.trajectory for track in tracks if track.trajectory is not None}
    return Tracked(document, known, empty_run(tracks))


def _how_well(points: int, errors: PlatformErrors, focal_px: float) -> str:
    """What all poses may have wrong together, in words."""
    deviations = np.sqrt(np.diag(errors.frame))
    bias_px = errors.bias.size * focal_px
    return (
        f"{points} points of the platform; its frame is known to {1e3 * deviations[:3].max():.3f} "
        f"mm and {1e3 * deviations[3:].max():.3f} mrad by the marked points and the images at "
        f"rest, which shifts all poses alike; its features err by {bias_px:.2f} px for good, which "
        "shifts all poses of a place alike: what is identified counts both"
    )


def frame_of_platform(covariance: Array, T_base_rest: Array) -> Array:
    """Covariance of the platform's frame in itself from that of its pose at rest, (6, 6).

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, eq. (13):
        propagation.
    """
    back = np.kron(np.eye(2), T_base_rest[:3, :3].T)
    return np.asarray(back @ covariance @ back.T)


def _watch(points_m: Array) -> Watch:
    """The points as markers that have names already."""
    count, none = len(points_m), np.zeros((0, 4, 3))
    names = tuple(f"point {k}" for k in range(count))
    return Watch((), none, (), none, names, points_m, np.zeros(count), named=True)


def _rests(untagged: Untagged, cameras: Sequence[Camera]) -> dict[str, Image]:
    """The mean of each camera's first frames of the platform at rest."""
    known = {camera.name: camera for camera in cameras}
    rests = {}
    for recording in find_recordings(untagged.rest):
        if recording.name not in known:
            continue
        frames = [f for _, _, f in itertools.islice(read_frames(recording), _FRAMES_AT_REST)]
        size = known[recording.name].size_px
        if not frames or frames[0].shape != size[::-1]:
            raise InputError(
                f"{recording.path}: needs images of {size[0]} x {size[1]} pixels, as cameras.toml "
                f"has camera {recording.name}"
            )
        mean = np.mean(np.array(frames, dtype=np.float32), axis=0)
        rests[recording.name] = np.asarray(np.rint(mean), dtype=np.uint8)
    if len(rests) < 2:
        raise InputError(
            f"{untagged.rest}: images of {len(rests)} calibrated camera(s), need two that see the "
            "platform from not too different sides, named as in cameras.toml"
        )
    return rests


def _swings(found: Sequence[tuple[Camera, Recording]]) -> dict[str, list[Image]]:
    """Some frames of each camera's recording of a swing."""
    swings = {}
    for camera, recording in found:
        last = _EVERY * _FRAMES_OF_A_SWING
        some = itertools.islice(read_frames(recording), 0, last, _EVERY)
        swings[camera.name] = [frame for _, _, frame in some]
    return swings


def _fused(
    sources: Sources, watch: Watch, settings: Settings
) -> list[tuple[Sequence[CameraViews], Poses]]:
    """Each run's cameras and poses with the points as they are."""
    runs = []
    for _, own in sources:
        views = [CameraViews(camera, paths) for camera, paths in own]
        corrected = correct_rig(views, watch, settings.survey_std_m, look=settings.correct_rig)
        runs.append((corrected.views, corrected.poses))
    return runs


def _grown(track: RunTrack, shared: float) -> RunTrack:
    """Deviations as large as the residuals say, each pixel being in so many patches."""
    squares, count = track.after.total
    freedom = count - 6 * track.known
    trajectory = track.trajectory
    if trajectory is None or trajectory.covariances is None or freedom <= 0:
        return track
    growth = shared * max(1.0, squares / freedom)
    covariances = trajectory.covariances * growth
    root = float(np.sqrt(growth))
    return replace(
        track,
        trajectory=replace(trajectory, covariances=covariances),
        std_m=track.std_m * root,
        std_rad=track.std_rad * root,
    )
