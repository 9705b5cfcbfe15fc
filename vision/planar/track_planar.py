"""`track --planar`: one camera from above, its lens known or not; chi, x and y with covariance.

Tags (or dots at known places) are followed as ever; then the plane in which they move is fitted
with the lens's unknown numbers over all runs, and every frame's x, y, chi in it. Rest is where the
platform is on the average of a run: x, y, chi count from there, along its axes at rest. Two dots
of which nothing is known become two uncalibrated signals.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.board.recordings import Recording, find_recordings, read_frames
from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.cdpr.files.signal_csv import SignalTable
from freeswing.cdpr.measured.target import Target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.system.progress import Progress
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.jobs import Job, run_jobs
from freeswing.vision.look.sightings import collect_sightings
from freeswing.vision.look.target_check import examined_watch
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.planar.dots import named
from freeswing.vision.planar.film_faults import moved_text, size_text, twice_text, unseen_text
from freeswing.vision.planar.films import (
    Film,
    FilmedRun,
    dot_items,
    dots_of,
    place_of,
    side_of,
    spots_of,
    tag_items,
    times_of,
)
from freeswing.vision.planar.fit_plane import PlaneFit, RunPlane, fit_planes
from freeswing.vision.planar.plane import Items
from freeswing.vision.planar.report import planar_run, signal_run
from freeswing.vision.planar.two_dots import COLUMNS, channel_block, dot_signals
from freeswing.vision.rig.lost.recounted import not_looked_for
from freeswing.vision.track_run import camera_count
from freeswing.vision.track_session import examined, sightings_folder

Array = NDArray[np.float64]

COORDINATES = ("x", "y", "chi")
PROVENANCE = "one camera from above"
USUAL_FOCAL = 0.8  # of the longer side: phones' main cameras, as they film
FARTHEST_M = 10.0  # of a tag or dot from P: no bench is as wide
LEAST_FRAMES = 40  # with the platform in them: two seconds of a phone
LONGEST_WAIT = 0.9  # of the progress goes into the images


@dataclass(frozen=True, slots=True)
class PlanarTracked:
    """What `track_planar` gives.

    Attributes:
        document: the content of results/tracking.json.
        trajectories: x, y, chi by run, where the scale is known.
        signals: two dots' ways by run, where nothing is known of them.
        channels: the block that session.toml needs for these, or empty.
        said: sentences about all runs.
    """

    document: dict[str, Any]
    trajectories: dict[str, Trajectory] = field(default_factory=dict)
    signals: dict[str, SignalTable] = field(default_factory=dict)
    channels: str = ""
    said: tuple[str, ...] = ()


def track_planar(
    runs: Sequence[FilmedRun],
    cameras: Sequence[Camera] | None,
    target: Target | None,
    *,
    results: Path,
    frame_rate_hz: float | None = None,
    workers: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> PlanarTracked:
    """Track all runs by one camera each.

    Args:
        runs: those with a video count.
        cameras: of cameras.toml, whose lens serves; None: the lens is not known.
        target: tags or dots on the platform; None: two dots of which nothing is known.
        results: the session's results folder, where sightings are kept.
        frame_rate_hz: serves recordings without presentation times.
        workers: processes; 0 = one a core.
        executor: follows the recordings instead of them.
        progress: told a label and the fraction done.

    Raises:
        InputError: recordings or a target that cannot be used.
        DataError: films that do not show what they should, with what is wrong.
    """
    filmed = [run for run in runs if run.video is not None]
    if not filmed:
        raise InputError("no run of the session has a video; there is nothing to track")
    found = [(run, _only(run)) for run in filmed]
    camera = _camera(found, cameras)
    watch = _watch(target)
    remarks = {run.name: examined([(camera, film)], frame_rate_hz) for run, film in found}
    if watch.tags:
        watch, said = examined_watch(watch, [(camera, found[0][1])])
        remarks[filmed[0].name] += said
    jobs = [
        Job(
            f"{run.name} {film.name}",
            collect_sightings,
            (sightings_folder(results, run.name), camera, watch, film, frame_rate_hz),
        )
        for run, film in found
    ]
    told = None if progress is None else lambda label, done: progress(label, LONGEST_WAIT * done)
    paths = run_jobs(jobs, workers, told, executor)
    films = [
        Film(run, film, CameraViews(camera, own))
        for (run, film), own in zip(found, paths, strict=True)
    ]
    lost = not_looked_for([film.views for film in films], "by one camera from above")
    if target is None or not (target.tags or target.markers):
        tracked = _two_dots(films, camera, watch, remarks)
    else:
        tracked = _in_plane(films, camera, watch, remarks, lens_known=cameras is not None)
    return replace(tracked, said=(*tracked.said, *lost))


def _only(run: FilmedRun) -> Recording:
    found = find_recordings(run.video or Path())
    if len(found) > 1:
        raise InputError(
            f"{run.video}: recordings of {', '.join(one.name for one in found)}; --planar takes "
            "one camera a run. Several cameras give full poses: calibrate them, track without "
            "--planar"
        )
    return next(iter(found))


def _camera(
    found: Sequence[tuple[FilmedRun, Recording]], cameras: Sequence[Camera] | None
) -> Camera:
    """The lens, as calibrated or as guessed; all runs have the same."""
    names = {film.name for _, film in found}
    if len(names) > 1:
        raise InputError(
            f"the runs' recordings are named {', '.join(sorted(names))}: --planar takes one camera "
            "for all runs; name its files alike"
        )
    name = names.pop()
    if cameras is not None:
        known = {camera.name: camera for camera in cameras}
        if name not in known:
            raise InputError(
                f"cameras.toml knows {', '.join(known)}, the recordings are named {name}: name the "
                "files as the camera is named, or leave cameras.toml out (the lens is then fitted)"
            )
        return replace(known[name], T_camera_base=np.eye(4))
    sizes = {(im.shape[1], im.shape[0]) for _, film in found for im in _first(film)}
    if len(sizes) != 1:
        shapes = ", ".join(f"{w} x {h}" for w, h in sorted(sizes)) or "nothing"
        raise InputError(f"the recordings of {name} show {shapes} pixels: film all runs alike")
    width, height = sizes.pop()
    focal = USUAL_FOCAL * max(width, height)
    numbers = np.array([focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)])
    return Camera(name, (int(width), int(height)), "PINHOLE", numbers, np.eye(4))


def _first(film: Recording) -> list[NDArray[np.uint8]]:
    for _, _, image in read_frames(film):
        return [image]
    return []


def _watch(target: Target | None) -> Watch:
    """What to look for: tags alone where there are any, else dots."""
    if target is not None:
        _check_places(target)
    if target is not None and target.tags:
        return Watch.of(replace(target, markers=()))
    if target is not None and target.markers:
        if len(target.markers) < 2:
            raise InputError("target.toml: one dot shows no yaw: --planar needs two or a tag")
        return Watch.of(target)
    none = np.zeros((0, 4, 3))
    return Watch((), none, (), none, COLUMNS, np.zeros((2, 3)), np.zeros(2))


def _check_places(target: Target) -> None:
    """Refuse tags and dots that lie beyond any platform.

    Raises:
        InputError: naming the first one.
    """
    places = [(f"tag {tag.family} {tag.id}", tag.T_platform_tag[:3, 3]) for tag in target.tags]
    places += [(f"marker {marker.name}", marker.position_m) for marker in target.markers]
    for name, place in places:
        far = float(np.linalg.norm(place))
        if far > FARTHEST_M:
            raise InputError(f"target.toml: {name} is {far:.4g} m from P: write metres, not mm")


def _two_dots(
    films: Sequence[Film], camera: Camera, watch: Watch, remarks: dict[str, list[str]]
) -> PlanarTracked:
    """Two dots as two uncalibrated signals a run."""
    focal = float(camera.focal_px.mean())
    direction, entries, tables = None, [], {}
    for film in films:
        spots = spots_of(film)
        dots = dots_of(film, spots, watch, 2)
        dots = named(dots, spots, np.array([[-1.0, 0.0], [1.0, 0.0]]), 1.0)
        told = dot_signals(dots, spots, focal, direction)
        direction = told.direction
        times = film.views.middle_times()
        known = np.isfinite(told.values_px).any(axis=1) & np.isfinite(times)
        tables[film.run.name] = SignalTable(
            times[known],
            dict(zip(COLUMNS, told.values_px[known].T, strict=True)),
            dict(zip(COLUMNS, told.std_px[known].T, strict=True)),
        )
        entries.append(signal_run(film.run.name, film.views, told, remarks[film.run.name]))
    said = (
        "two dots of which nothing is known: two signals, dot1_px and dot2_px, across the line "
        "that joins them. session.toml needs the [[channels]] below (--write-channels puts them "
        "there); with target.toml, what the dots' places are gives chi, x and y instead",
    )
    return PlanarTracked(_document(entries), {}, tables, channel_block(), said)


def _in_plane(
    films: Sequence[Film],
    camera: Camera,
    watch: Watch,
    remarks: dict[str, list[str]],
    *,
    lens_known: bool,
) -> PlanarTracked:
    """x, y, chi of every run."""
    side = side_of(watch, films[0])
    seen = [tag_items(one, watch) if watch.tags else dot_items(one, watch, side) for one in films]
    for film, items in zip(films, seen, strict=True):
        _check_seen(film, items, watch)
    counts = [len(film.views.numbers) for film in films]
    try:
        fit = fit_planes(seen, counts, side, lens_known)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise DataError(f"the platform's plane cannot be fitted: {error}") from error
    entries, trajectories = [], {}
    for k, film in enumerate(films):
        times = times_of(film, seen[k])
        trajectory = _from_rest(film, fit.runs[k], times)
        _check_motion(film, fit.runs[k], times, watch)
        trajectories[film.run.name] = trajectory
        entries.append(
            planar_run(
                film.run.name,
                camera_count(film.views),
                camera,
                fit,
                k,
                trajectory,
                place_m=place_of(watch),
                lens_known=lens_known,
                problems=remarks[film.run.name],
            )
        )
    return PlanarTracked(_document(entries), trajectories, said=_lens_said(fit, camera, lens_known))


def _document(entries: Sequence[dict[str, Any]]) -> dict[str, Any]:
    return {"format": "freeswing-tracking/1", "runs": list(entries), "effects": []}


def _check_seen(film: Film, items: Items, watch: Watch) -> None:
    frames = len(np.unique(items.frames))
    if not frames:
        raise DataError(unseen_text(watch, film.recording, film.run.name))
    if frames >= LEAST_FRAMES:
        return
    twice = twice_text(watch, film.recording, film.run.name)
    raise DataError(
        twice
        or f"run {film.run.name}: {film.recording.path.name}: the platform is seen in {frames} of "
        f"{len(film.views.numbers)} frames, {LEAST_FRAMES} are needed: keep it in view and lit"
    )


def _from_rest(film: Film, found: RunPlane, times: Array) -> Trajectory:
    """The run about its mean, along the platform's axes there."""
    seen = np.isfinite(found.poses).all(axis=1) & np.isfinite(times)
    known = film.known(times, seen)
    if known.sum() < LEAST_FRAMES:
        start, end = film.run.window_s or (0.0, 0.0)
        raise DataError(
            f"run {film.run.name}: the platform is seen in {int(known.sum())} frames of its "
            f"window_s [{start:g}, {end:g}]; the film lasts from {np.nanmin(times):.3f} to "
            f"{np.nanmax(times):.3f} s"
        )
    rest = found.poses[known].mean(axis=0)
    cos, sin = np.cos(rest[2]), np.sin(rest[2])
    turn = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    order = np.flatnonzero(seen)
    covariances = turn @ (found.covariances + found.systematic)[order] @ turn.T
    values = (found.poses[order] - rest) @ turn.T
    return Trajectory(times[order], COORDINATES, values, covariances, PROVENANCE)


def _check_motion(film: Film, found: RunPlane, times: Array, watch: Watch) -> None:
    """What the motion says of the tags' size and of the camera.

    Raises:
        DataError: where one of them must be wrong.
    """
    seen = np.isfinite(found.poses).all(axis=1) & np.isfinite(times)
    known = film.known(times, seen)
    poses = found.poses[known]
    told = moved_text(times[known], poses, film.run.name)
    if told is None and watch.tags:
        corners = watch.tag_corners_m
        side = float(np.linalg.norm(corners[0, 1] - corners[0, 0]))
        told = size_text(poses, corners.reshape(-1, 3).mean(axis=0)[:2], side, film.run.name)
    if told is not None:
        raise DataError(told)


def _lens_said(fit: PlaneFit, camera: Camera, lens_known: bool) -> tuple[str, ...]:
    """What an unknown lens leaves uncertain, in a sentence."""
    if lens_known:
        return ()
    focal = float(camera.focal_px.mean()) * float(np.exp(fit.lens[0]))
    return (
        f"the lens is not known (no cameras.toml): its focal length is fitted to {focal:.0f} +- "
        f"{focal * fit.lens_std[0]:.0f} px, its distortion to {fit.lens[1]:+.3f} +- "
        f"{fit.lens_std[1]:.3f}, the plane's lean to {1e3 * float(fit.lean_std.max()):.0f} mrad; "
        "the deviations of x, y and chi hold what that leaves open",
    )
