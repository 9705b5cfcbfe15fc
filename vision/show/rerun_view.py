"""A recording of tracked runs for the viewer rerun: cameras, platform, tags and sightings in time.

rerun-sdk is an extra (`view`) and imported here alone. Images are left out: the recording stays
small, and overlay videos show them.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.rotation import invert, quaternion_from_matrix
from freeswing.cdpr.system.drafts import draft_of
from freeswing.vision.tracked_runs import TrackedCamera, TrackedRun

Array = NDArray[np.float64]

_PLATFORM, _BASE = (90, 200, 90), (80, 150, 250)
_FRUSTUM_M = 0.25


def require_viewer() -> Any:
    """The module `rerun`.

    Raises:
        InputError: where it is not installed, with what to do.
    """
    try:
        return importlib.import_module("rerun")
    except ImportError as error:
        raise InputError(
            "--view needs the viewer's package, an extra: pip install 'freeswing[view]' "
            f"({error}); --overlay works without"
        ) from error


def write_view(path: Path, runs: Sequence[TrackedRun]) -> None:
    """Writes all runs to one recording, each below its own name and on its own time line.

    Raises:
        InputError: where rerun is not installed.
    """
    rr = require_viewer()
    with draft_of(path) as draft:
        stream = rr.RecordingStream("freeswing")
        stream.save(draft.name)
        for run in runs:
            _log_still(rr, stream, run)
            _log_platform(rr, stream, run)
            for seen in run.cameras:
                _log_camera(rr, stream, run, seen)
        stream.flush()
        stream.disconnect()


def _log_still(rr: Any, stream: Any, run: TrackedRun) -> None:
    stream.log(run.name, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    loops = _loops(run.watch.base_corners_m)
    if loops:
        stream.log(f"{run.name}/base_tags", rr.LineStrips3D(loops, colors=_BASE), static=True)


def _log_platform(rr: Any, stream: Any, run: TrackedRun) -> None:
    place, known = f"{run.name}/platform", run.trajectory.is_known
    trajectory = run.trajectory.take(known)
    positions = trajectory.positions()
    times = [rr.TimeColumn(f"{run.name} time", duration=trajectory.times_s)]
    moved: dict[str, Any] = {"translation": positions}
    if trajectory.is_pose:
        quaternions = quaternion_from_matrix(trajectory.rotations())
        moved["quaternion"] = np.roll(quaternions, -1, axis=-1)  # x y z w
    stream.send_columns(place, times, rr.Transform3D.columns(**moved))
    deviations = trajectory.standard_deviations()
    if deviations is not None:
        worst_mm = 1e3 * deviations[:, :3].max(axis=1)
        stream.send_columns(
            f"{run.name}/position_std_mm", times, rr.Scalars.columns(scalars=worst_mm)
        )
    stream.log(f"{run.name}/path", rr.LineStrips3D([positions], colors=_PLATFORM), static=True)
    loops = _loops(run.watch.tag_corners_m)
    if loops:
        stream.log(f"{place}/tags", rr.LineStrips3D(loops, colors=_PLATFORM), static=True)
    if len(run.watch.marker_positions_m):
        markers = rr.Points3D(run.watch.marker_positions_m, radii=0.006, labels=run.watch.markers)
        stream.log(f"{place}/markers", markers, static=True)


def _log_camera(rr: Any, stream: Any, run: TrackedRun, seen: TrackedCamera) -> None:
    camera, place = seen.camera, f"{run.name}/cameras/{seen.camera.name}"
    T_base_camera = invert(camera.T_camera_base)
    pose = rr.Transform3D(translation=T_base_camera[:3, 3], mat3x3=T_base_camera[:3, :3])
    stream.log(place, pose, static=True)
    lens = rr.Pinhole(
        focal_length=[float(v) for v in camera.focal_px],
        width=camera.size_px[0],
        height=camera.size_px[1],
        image_plane_distance=_FRUSTUM_M,
    )
    stream.log(f"{place}/image", lens, static=True)
    times, counts, points, used = [], [], [], []
    for piece, row in seen.frames():
        stamp = float(piece.stamps_s[row])
        if not np.isfinite(stamp):
            continue
        mine = piece.frame_of == row
        rays = piece.rays[mine].reshape(-1, 4, 2)
        rays = rays[piece.covariances[mine][:, 2, 2] > 0.0].reshape(-1, 2)
        pixels = camera.project(np.column_stack([rays, np.ones(len(rays))]))
        times.append(stamp + camera.clock_offset_s)
        counts.append(len(pixels))
        points.append(pixels)
        used.append(float(np.count_nonzero(mine)))
    if not times:
        return
    line = [rr.TimeColumn(f"{run.name} time", duration=np.array(times))]
    corners = rr.Points2D.columns(positions=np.concatenate(points)).partition(lengths=counts)
    stream.send_columns(f"{place}/image/corners", line, corners)
    stream.send_columns(f"{place}/sightings", line, rr.Scalars.columns(scalars=np.array(used)))


def _loops(corners_m: Array) -> list[Array]:
    """Closed outlines of tags (n, 4, 3)."""
    return [np.vstack([corners, corners[:1]]) for corners in corners_m]
