"""The demonstration's cameras, what they look at, and their calibration footage."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.measured.target import Tag, Target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.cdpr.rotation import exp_rotation
from freeswing.cdpr.system.progress import Progress
from freeswing.demo.truth import Swing
from freeswing.vision.render.patterns import Patch, charuco_patch, tag_patch
from freeswing.vision.render.record import record
from freeswing.vision.render.render_scene import Look, Motion, Scene, motion_of

Shot = Callable[[], None]  # one camera's recording of one scene, taken when called

SIZE_PX = (640, 480)
RATE_HZ = 30.0
BOARD_RATE_HZ = 10.0
SPLINE_HZ = 400.0
BOARD_SECONDS = 5.0
BOARD = {
    "kind": "charuco",
    "squares": [9, 6],
    "square_m": 0.06,
    "marker_m": 0.045,
    "dictionary": "DICT_5X5_100",
}
FAMILY = "tag36h11"
TAG_M = 0.11
BASE_TAG_M = 0.2
CENTRE_M = np.array([1.25, -0.25, -0.05])
LOOK = Look(psf_px=0.6, noise=1.2, subpixels=3)
_PLACES = (
    ((1.25, -2.05, 0.20), (690.0, 692.0, 318.2, 241.1, -0.11, 0.04, 5e-4, -3e-4), 0.0),
    ((0.25, -1.85, 0.0), (701.0, 700.0, 322.4, 238.0, -0.10, 0.03, -4e-4, 2e-4), 0.0031),
    ((2.25, -1.85, 0.30), (684.0, 686.0, 320.9, 243.3, -0.12, 0.05, 2e-4, 4e-4), -0.0047),
)


def true_cameras() -> tuple[Camera, ...]:
    """Three distorting lenses whose clocks disagree by milliseconds."""
    return tuple(
        Camera(f"cam{k}", SIZE_PX, "OPENCV", np.array(lens), _looking(place), offset)
        for k, (place, lens, offset) in enumerate(_PLACES)
    )


def demo_target() -> Target:
    """Six tags on the platform's front, turned a little to the left and to the right."""
    tags = []
    for row, (z, turn) in enumerate(((0.05, 0.5), (0.20, 0.3))):
        for column, side in enumerate((-1.0, 0.0, 1.0)):
            place = np.array([0.15 * side, -0.24 + 0.12 * abs(turn * side), z])
            pose = _facing(place, turn * side)
            tags.append(Tag(FAMILY, 3 * row + column, TAG_M, pose))
    return Target(tuple(tags))


def base_tags() -> tuple[Tag, ...]:
    """Surveyed tags on the frame behind the platform, in the base frame."""
    places = ((0.80, 0.80, 0.35), (1.75, 0.85, 0.40), (0.85, 0.75, -0.50), (1.70, 0.8, -0.55))
    return tuple(
        Tag(FAMILY, 100 + k, BASE_TAG_M, _facing(np.array(place), 0.0))
        for k, place in enumerate(places)
    )


def board_shots(folder: Path, seed: int) -> list[Shot]:
    """`calibration/<camera>.avi`: a board carried through the field of view."""
    board = charuco_patch(
        (9, 6), BOARD["square_m"], BOARD["marker_m"], str(BOARD["dictionary"])
    ).moved(_facing(np.zeros(3), 0.0), "platform")
    stamps = np.arange(round(BOARD_SECONDS * BOARD_RATE_HZ)) / BOARD_RATE_HZ
    return _shots(folder, Scene((*_still_patches(), board), _carried), stamps, seed)


def swing_shots(folder: Path, swing: Swing, cut_s: float, seed: int) -> list[Shot]:
    """`runs/<name>/<camera>.avi` of one swing, but for `cut_s` at either end."""
    start, end = cut_s, swing.motion.end_s - cut_s
    stamps = start + np.arange(round((end - start) * RATE_HZ)) / RATE_HZ
    patches = [tag_patch(t.family, t.id, t.size_m, t.T_platform_tag) for t in demo_target().tags]
    return _shots(folder, Scene((*_still_patches(), *patches), _motion(swing)), stamps, seed)


def _shots(folder: Path, scene: Scene, stamps: Array, seed: int) -> list[Shot]:
    return [
        partial(record, folder, [camera], scene, stamps, LOOK, seed, suffix=".avi")
        for camera in true_cameras()
    ]


def film(shots: Sequence[Shot], progress: Progress | None = None) -> None:
    """Takes all shots, one thread a core: the renderer leaves the interpreter free."""
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        jobs = [pool.submit(shot) for shot in shots]
        for done, job in enumerate(jobs):
            if progress is not None:
                progress("filming the board and the swings", done / len(jobs))
            job.result()


def _still_patches() -> list[Patch]:
    return [tag_patch(t.family, t.id, t.size_m, t.T_platform_tag, "base") for t in base_tags()]


def _motion(swing: Swing) -> Motion:
    """The swing by splines through samples so dense that they differ by nanometres."""
    times = np.arange(0.0, swing.motion.end_s, 1.0 / SPLINE_HZ)
    return motion_of(Trajectory(times, POSE_COORDINATES, swing.motion.at(times)[0]))


def _carried(times_s: Array) -> tuple[Array, Array]:
    """A board moved slowly to and fro, near and far, tilted every way."""
    t = np.asarray(times_s)
    way = np.stack(
        [0.42 * np.sin(1.3 * t), 0.35 * np.sin(0.9 * t + 1.0), 0.3 * np.sin(2.1 * t + 0.5)], axis=1
    )
    tilt = np.stack(
        [0.5 * np.sin(1.7 * t), 0.3 * np.sin(1.1 * t + 2.0), 0.55 * np.sin(0.8 * t + 0.3)], axis=1
    )
    return CENTRE_M + np.array([0.0, -0.2, 0.0]) + way, exp_rotation(tilt)


def _facing(place_m: Array, yaw_rad: float) -> Array:
    """T_parent_tag of an upright tag that faces -y, turned about z."""
    turn = exp_rotation(np.array([0.0, 0.0, yaw_rad]))
    pose = np.eye(4)
    pose[:3, :3] = turn @ np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    pose[:3, 3] = place_m
    return pose


def _looking(place_m: tuple[float, float, float]) -> Array:
    """T_camera_base of a camera that looks at the middle of the workspace."""
    place = np.array(place_m)
    forward = (CENTRE_M - place) / np.linalg.norm(CENTRE_M - place)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = -pose[:3, :3] @ place
    return pose
