"""What tracking.json says of runs by one camera from above."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.planar.fit_plane import PlaneFit
from freeswing.vision.planar.two_dots import DotSignals
from freeswing.vision.track_run import CameraCount, camera_count, count_problems

Array = NDArray[np.float64]


def planar_run(
    name: str,
    count: CameraCount,
    camera: Camera,
    fit: PlaneFit,
    index: int,
    trajectory: Trajectory,
    *,
    place_m: Array,
    lens_known: bool,
    problems: Sequence[str],
) -> dict[str, Any]:
    """The entry of a run in `runs`; `planar` tells the plane and what x and y are of."""
    own = fit.runs[index]
    plane = own.plane
    focal = float(camera.focal_px.mean())
    stds = trajectory.standard_deviations()
    median = np.full(3, np.nan) if stds is None else np.median(stds, axis=0)
    return {
        **_counted(name, count, len(trajectory), trajectory.sample_rate_hz, problems),
        "position_std_mm": 1e3 * float(median[:2].max()),
        "rotation_std_mrad": 1e3 * float(median[2]),
        "reprojection_px": focal * own.miss,
        "planar": {
            "place_m": place_m.tolist(),
            "lens_known": lens_known,
            "focal_px": focal * float(np.exp(plane.numbers[0])),
            "focal_std_px": focal * float(np.exp(plane.numbers[0]) * fit.lens_std[0]),
            "distance_m": plane.distance_m,
            "lean_rad": float(np.hypot(*plane.numbers[2:4])),
            "lean_std_rad": float(fit.lean_std[index]),
            "systematic_std_mm": 1e3 * _largest(own.systematic, (0, 1)),
            "systematic_std_mrad": 1e3 * _largest(own.systematic, (2,)),
        },
    }


def signal_run(
    name: str, views: CameraViews, told: DotSignals, problems: Sequence[str]
) -> dict[str, Any]:
    """The entry of a run whose two dots are signals."""
    known = np.isfinite(told.values_px).any(axis=1)
    times = views.middle_times()[known]
    rate = float(1.0 / np.median(np.diff(times)))
    ways = np.nanmax(told.values_px, axis=0) - np.nanmin(told.values_px, axis=0)
    said = (
        f"the dots lie {told.apart_px:.0f} px apart and go {ways[0]:.0f} and {ways[1]:.0f} px, "
        f"noise {np.nanmedian(told.std_px):.2g} px"
    )
    return _counted(name, camera_count(views), int(known.sum()), rate, [*problems, said])


def _counted(
    name: str, count: CameraCount, known: int, rate_hz: float, problems: Sequence[str]
) -> dict[str, Any]:
    camera = {
        "camera": count.name,
        "frames_seen": count.frames,
        "frames_used": count.used,
        "frames_rejected": count.rejected,
        "frames_dropped": count.dropped,
    }
    return {
        "run": name,
        "samples": count.frames,
        "known": known,
        "rate_hz": rate_hz,
        "cameras": [camera],
        "problems": [*problems, *count_problems([count])],
    }


def _largest(covariances: Array, which: tuple[int, ...]) -> float:
    variances = np.diagonal(covariances, axis1=1, axis2=2)[:, which]
    return float(np.sqrt(np.nanmax(variances)))
