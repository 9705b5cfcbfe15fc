"""Cameras that no surveyed tag holds, against each other: did one move since its calibration?

A camera that turned a little still sees a platform that swings, only elsewhere, and two cameras
make of both views one pose that suits neither. Each camera sees the platform's whole pose, so that
the place of one camera by the other follows from the swing (the platform's poses eliminated) with
its deviation. Which of them moved is not told, nor therefore where the platform truly was.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.rotation import log_rotation
from freeswing.vision.fuse.fuse_cameras import Fit, fuse
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.rig.moved_cameras import base_tag_misses
from freeswing.vision.rig.rig_kernels import CLOCK, PER_CAMERA, POSE
from freeswing.vision.rig.rig_step import iterated

Array = NDArray[np.float64]

KNOCKED_PX = 2.0
"""What lenses and calibrations leave between cameras is 0.05 to 0.5 px; a knock is several."""
SURE_SIGMAS = 6.0  # of a change of six numbers: none by chance in 1e5 runs
_LEAST_TAGS = 2  # one alone leaves a camera its turn about the tag, and may have been bumped
_LEAST_KNOWN = 20  # poses: fewer have no swing that a place could follow from


def untied_shifts(
    views: Sequence[CameraViews], watch: Watch, poses: Poses, fit: Fit, survey_std_m: float
) -> tuple[Array | None, tuple[str, ...]]:
    """How far poses would go were each untied camera where the others' view of the swing has it.

    Args:
        views: cameras, their clocks and line times corrected.
        watch: what was looked for.
        poses: of the platform, by all cameras.
        fit: how the sightings agree with them.
        survey_std_m: of the base tags' corners.

    Returns:
        Changes of position and small rotation, zero where no disagreement is sure, (n, 6), None
        where base tags hold every camera; and what a reader should know.

    Raises:
        DataError: when a camera has moved by more than calibrations leave.

    Source:
        Triggs et al. 2000, Bundle Adjustment - A Modern Synthesis, sec. 6: poses eliminated.
    """
    held = [len(base_tag_misses(view, watch)[1]) >= _LEAST_TAGS for view in views]
    if len(views) < 2 or all(held) or not watch.tags or int(poses.known.sum()) < _LEAST_KNOWN:
        return None, ()
    nothing = np.zeros((len(poses.times_s), 6))
    trusted = held if any(held) else [True] * len(views)
    frames = [len(v.numbers) if own else -1 for v, own in zip(views, trusted, strict=True)]
    reference = int(np.argmax(frames))
    free = np.zeros((len(views), PER_CAMERA), dtype=bool)
    free[:, CLOCK] = np.arange(len(views)) != reference
    free[[k for k, own in enumerate(held) if not own and k != reference], POSE:] = True
    current, total = list(views), np.zeros(free.shape)
    step = iterated(current, watch, poses, fit, free, total, survey_std_m, told=False)
    sure = [
        k
        for k in np.flatnonzero(free[:, POSE]).tolist()
        if is_sure(total[k, POSE:], step.covariance[_pose_of(k), _pose_of(k)])
    ]
    if not sure:
        return nothing, ()
    off = {k: _seen_apart_px(views[k].camera, current[k].camera, poses) for k in sure}
    worst = max(off, key=lambda k: off[k])
    names = views[worst].camera.name, views[reference].camera.name
    said = _text(views[worst].camera, current[worst].camera, names[1], off[worst])
    if was_knocked(off[worst]):
        raise DataError(
            f"{said}: one of them moved since it was calibrated. Base tags in both pictures would "
            "tell which: survey some, or calibrate again"
        )
    apart, _ = fuse(current, watch, poses.times_s, start=poses, passes=2, rough=True)
    both = poses.known & apart.known
    turns = apart.rotations[both] @ np.swapaxes(poses.rotations[both], 1, 2)
    shifts = apart.positions_m[both] - poses.positions_m[both]
    nothing[both] = np.concatenate([shifts, log_rotation(turns)], axis=1)
    median_mm = 1e3 * float(np.median(np.linalg.norm(shifts, axis=1)))
    return nothing, (
        f"{said}: which of them is right is not told, and the deviations of what is identified "
        f"count a shift of {median_mm:.2f} mm of all poses",
    )


def was_knocked(apart_px: float) -> bool:
    """Whether cameras see the platform further apart than calibrations leave."""
    return apart_px > KNOCKED_PX


def is_sure(change: Array, covariance: Array) -> bool:
    """Whether a change of pose (6,) stands out of its covariance (6, 6)."""
    return float(change @ np.linalg.pinv(covariance, hermitian=True) @ change) > SURE_SIGMAS**2


def _pose_of(index: int) -> slice:
    return slice(PER_CAMERA * index + POSE, PER_CAMERA * (index + 1))


def _seen_apart_px(before: Camera, after: Camera, poses: Poses) -> float:
    """How far apart both see the platform's origin, px, the median along the run."""
    places = poses.positions_m[poses.known]
    one, other = (camera.project(camera.to_camera(places)) for camera in (before, after))
    return float(np.nanmedian(np.linalg.norm(one - other, axis=1)))


def _text(before: Camera, after: Camera, other: str, apart_px: float) -> str:
    turn = log_rotation(after.T_camera_base[:3, :3] @ before.T_camera_base[:3, :3].T)
    shift = float(np.linalg.norm(after.position_base_m - before.position_base_m))
    return (
        f"camera {before.name} is not where its calibration has it: by what {other} sees of the "
        f"swing it is turned by {1e3 * float(np.linalg.norm(turn)):.1f} mrad and "
        f"{1e3 * shift:.1f} mm away, so that the platform is {apart_px:.1f} px off"
    )
