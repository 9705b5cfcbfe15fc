"""A small filmed run that the tests of tracking share, and its errors."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.files.documents import DataError, write_json
from freeswing.cdpr.files.trajectory_files import write_csv
from freeswing.cdpr.measured.target import Target
from freeswing.cdpr.rotation import log_rotation
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Look
from freeswing.vision.track_session import track_session
from tests.vision.scenes import (
    OPENCV_PARAMS,
    SurveyedTag,
    arc_of_cameras,
    platform_tags,
    scene_of,
    standing_tags,
    swing,
)

FRAMES = 60
STAMPS = 0.3 + np.arange(FRAMES) / 50.0
TARGET = Target(platform_tags())
BASE = tuple(SurveyedTag(tag) for tag in standing_tags())
LATE_S = -0.006
KNOCK_RAD = np.array([0.0035, -0.0045, 0.002])


@dataclass
class FilmedRun:
    name: str
    video: Path


def cameras() -> tuple[Camera, ...]:
    half = [v / 2 for v in OPENCV_PARAMS[:4]] + OPENCV_PARAMS[4:]
    return arc_of_cameras(3, 1.9, size_px=(360, 288), params=half)


def film(folder, true_cameras, frames=FRAMES, **changes) -> FilmedRun:
    scene = scene_of(TARGET.tags, standing_tags(), **changes)
    look = Look(noise=2.0, subpixels=3)
    record(folder / "runs" / "swing", true_cameras, scene, STAMPS[:frames], look, seed=2)
    return FilmedRun("swing", folder / "runs" / "swing")


def tracked(runs, cameras, target, *, results, base_tags=(), **options):
    """Track, and write what comes of it as the command does; the document."""
    found = track_session(runs, cameras, Watch.of(target, base_tags), results=results, **options)
    for name, trajectory in found.trajectories.items():
        write_csv(results / "tracks" / f"{name}.csv", trajectory)
    write_json(results / "tracking.json", found.document)
    if found.refused is not None:
        raise DataError(found.refused)
    return found.document


def track(run, folder, view=None, **settings):
    return tracked(
        [run],
        view or cameras(),
        TARGET,
        results=folder / "results",
        base_tags=BASE,
        workers=1,
        **settings,
    )


def errors(trajectory) -> np.ndarray:
    """Position and small-rotation errors, (n, 6)."""
    positions, rotations = swing(trajectory.times_s)
    turn = log_rotation(trajectory.rotations() @ np.swapaxes(rotations, 1, 2))
    return np.concatenate([trajectory.positions() - positions, turn], axis=1)
