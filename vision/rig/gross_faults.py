"""What cannot happen to a mounted camera is a mistake in the files: it is named, not corrected.

Where a camera really is, follows from the surveyed tags it sees, or from the platform that another
camera sees too. A camera that was knocked turns by degrees and shifts by centimetres; what lies
beyond is held against the usual mistakes, and the one that explains all cameras is said.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.rotation import invert, log_rotation, transform
from freeswing.vision.fuse.fuse_cameras import Fit
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.look.single_pose import start_pose
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.rig.lag_search import Pair
from freeswing.vision.rig.moved_cameras import base_tag_rays

Array = NDArray[np.float64]

MOST_TURN_RAD = 0.15
"""A clamp that gives way lets a camera turn by a few degrees before it falls; 0.15 is 9."""
MOST_SHIFT_M = 0.2  # a tripod that slid by more was moved, not knocked
MOST_APART_M = 0.06
"""Two cameras without base tags that see the platform so far apart: one of them moved."""
MOST_FLOOR_PX = 1.0
"""Cameras of one rig leave 0.02 to 0.5 px beyond the pixels' noise; a wrong rig more."""
MOST_REJECTED = 0.5  # of a camera's sightings: then it is the camera, not the tags
MOST_CONTRADICTING = 2
"""Frames on end of which a camera's every tag lies four deviations off: one that was stamped late
passes by, a third is no chance."""
_SAME_TURN_RAD = 0.05  # good calibrations turn cameras by thousandths
_SIZE_RANGE = (0.3, 3.0)
_SAME_SIZE = 0.03  # distances between cameras are known to one per cent or two


@dataclass(frozen=True, slots=True)
class Evidence:
    """Where a camera is, seen from the base (first None) or from another camera: (4, 4)."""

    first: int | None
    second: int
    T_first_second: Array


def refuse_gross(
    views: Sequence[CameraViews], watch: Watch, pairs: dict[tuple[int, int], Pair]
) -> None:
    """Passes cameras that are about where they should be.

    Raises:
        DataError: naming the camera that is not, and the mistake that explains it.
    """
    told = _by_base_tags(views, watch)
    tied = {evidence.second for evidence in told}
    for (first, second), pair in pairs.items():
        if not {first, second} <= tied and stand_elsewhere(pair):
            told.append(Evidence(first, second, pair.T_first_second))
    poses = [view.camera.T_camera_base for view in views]
    wrong = [evidence for evidence in told if _badness(evidence, poses) > 1.0]
    apart = [evidence for evidence in told if evidence.first is not None]
    if not wrong and not apart:
        return
    names = [view.camera.name for view in views]
    if wrong:
        fits = _explained(told, poses, names)
        raise DataError(_text(wrong[0], poses, names) + (fits or _UNEXPLAINED))
    raise DataError(
        _text(apart[0], poses, names)
        + ": one of them moved since it was calibrated. Base tags in both pictures would tell "
        "which: survey some, or calibrate again"
    )


_UNEXPLAINED = (
    ". None of the usual mistakes explains it (cameras exchanged, turned, unit, inverted pose, "
    "axes, size of the tags): calibrate again, unless what this run holds of the cameras are "
    "recordings of different swings"
)


def stand_elsewhere(pair: Pair) -> bool:
    """Whether two cameras see a platform that cannot be one as they are calibrated."""
    return pair.known_m > MOST_APART_M + 3.0 * pair.miss_m


def moved_too_far(before: Camera, after: Camera) -> bool:
    """Whether a correction is more than a knock."""
    return _beyond(before.T_camera_base @ invert(after.T_camera_base)) > 1.0


def refuse_disagreement(views: Sequence[CameraViews], fit: Fit) -> None:
    """Passes cameras that agree once the rig is corrected.

    Raises:
        DataError: naming the camera that still does not see the platform where the others do.
    """
    for index, view in enumerate(views):
        lost = sum(count for (camera, _), (count, _, _) in fit.rejected.items() if camera == index)
        floor, used = float(fit.floor_px[index]), int(fit.used[index])
        told = None
        if floor > MOST_FLOOR_PX and used:
            told = f"sees the platform {floor:.1f} px from where all cameras put it"
        elif len(views) > 1 and lost > MOST_REJECTED * (lost + used):
            told = f"contradicts the other cameras in {lost} of {lost + used} sightings"
        if told is not None:
            raise DataError(
                f"camera {view.camera.name} {told}, after clocks, rolling shutter and knocks were "
                "looked for: it moved or was refocused since its calibration, its frames are not "
                "stamped when they were taken, or target.toml is wrong. Calibrate again; "
                "freeswing check names what the files show"
            )


def refuse_contradicting(views: Sequence[CameraViews], fit: Fit) -> None:
    """Passes cameras of which no frames on end contradict the others with all they show.

    Raises:
        DataError: naming the camera and the first of these frames.
    """
    for view, frames in zip(views, fit.contradicting, strict=False):
        first, count = longest_on_end(frames)
        if count > MOST_CONTRADICTING:
            raise DataError(
                f"camera {view.camera.name} contradicts the others from frame {first} on with all "
                f"that it shows, {count} frames on end, and agrees elsewhere: frames of one camera "
                "were lost there while its stamps were counted on, or are not stamped when they "
                f"were taken. Put their own times beside the videos ({view.camera.name}.csv with "
                "frame,t_s), or film again"
            )


def longest_on_end(frames: Sequence[int]) -> tuple[int, int]:
    """First and number of the longest run of frame numbers one after another; (0, 0) for none."""
    best, run = (0, 0), (0, 0)
    for frame in frames:
        run = (run[0], run[1] + 1) if frame == run[0] + run[1] else (frame, 1)
        best = max(best, run, key=lambda one: one[1])
    return best


def _by_base_tags(views: Sequence[CameraViews], watch: Watch) -> list[Evidence]:
    """Cameras that see base tags, where these put them."""
    found = []
    for index, view in enumerate(views):
        rays, _, corners, _ = base_tag_rays(view, watch)
        if len(corners) < 2:
            continue
        pose = start_pose(corners, rays)
        if pose is not None:
            found.append(Evidence(None, index, invert(transform(*pose))))
    return found


def _beyond(difference: Array) -> float:
    """A change of pose in units of what a knock can do."""
    turn = float(np.linalg.norm(log_rotation(difference[:3, :3])))
    place = -difference[:3, :3].T @ difference[:3, 3]
    return max(turn / MOST_TURN_RAD, float(np.linalg.norm(place)) / MOST_SHIFT_M)


def _badness(evidence: Evidence, poses: Sequence[Array]) -> float:
    T_second_base = poses[evidence.second]
    T_base_first = np.eye(4) if evidence.first is None else invert(poses[evidence.first])
    return _beyond(T_second_base @ T_base_first @ evidence.T_first_second)


def _text(evidence: Evidence, poses: Sequence[Array], names: Sequence[str]) -> str:
    T_base_first = np.eye(4) if evidence.first is None else invert(poses[evidence.first])
    off = poses[evidence.second] @ T_base_first @ evidence.T_first_second
    turn = float(np.linalg.norm(log_rotation(off[:3, :3])))
    shift = float(np.linalg.norm(off[:3, 3]))
    by = "the base tags" if evidence.first is None else f"camera {names[evidence.first]}"
    return (
        f"camera {names[evidence.second]} is not where cameras.toml has it: by {by} it is turned "
        f"by {turn:.2f} rad and {shift:.2f} m away"
    )


def _explained(told: Sequence[Evidence], poses: list[Array], names: Sequence[str]) -> str | None:
    """The mistake that, undone, leaves every camera within reach of a knock."""
    best: tuple[float, str] | None = None
    for text, trial in _mistakes(poses, names):
        worst = max(_badness(evidence, trial) for evidence in told)
        if worst <= 1.0 and (best is None or worst < best[0]):
            best = (worst, text)
    if best is not None:
        return f". It fits {best[1]}"
    return _size_of_tags(told, poses)


def _mistakes(poses: list[Array], names: Sequence[str]) -> Iterator[tuple[str, list[Array]]]:
    """The rig with each usual mistake undone."""
    for i, k in combinations(range(len(poses)), 2):
        trial = list(poses)
        trial[i], trial[k] = poses[k], poses[i]
        yield f"when {names[i]} and {names[k]} are exchanged: their names or files are", trial
    for what, change in _CHANGES:
        yield f"when {what} for all cameras", [change(pose) for pose in poses]
        for i, name in enumerate(names):
            yield f"when {what} for {name}", [*poses[:i], change(poses[i]), *poses[i + 1 :]]


def _turned(quarters: int, pose: Array) -> Array:
    c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[quarters % 4]
    turn = np.eye(4)
    turn[:2, :2] = [[c, -s], [s, c]]
    return turn @ pose


def _scaled(factor: float, pose: Array) -> Array:
    return transform(pose[:3, :3], factor * pose[:3, 3])


_CHANGES = (
    ("the picture is turned by 180 degrees", lambda pose: _turned(2, pose)),
    ("the picture is turned by 90 degrees", lambda pose: _turned(1, pose)),
    ("the picture is turned by -90 degrees", lambda pose: _turned(3, pose)),
    ("t_camera_base_m is in millimetres, not metres,", lambda pose: _scaled(1e-3, pose)),
    ("t_camera_base_m is 1000 times as large", lambda pose: _scaled(1e3, pose)),
    ("the pose is inverted (base to camera is asked for)", invert),
    (
        "the camera's axes are x right, y up, z backwards",
        lambda pose: np.diag([1.0, -1.0, -1.0, 1.0]) @ pose,
    ),
    (
        "t_camera_base_m is the camera's place in the base, not the base's in the camera,",
        lambda pose: transform(pose[:3, :3], -pose[:3, :3] @ pose[:3, 3]),
    ),
)


def _size_of_tags(told: Sequence[Evidence], poses: Sequence[Array]) -> str | None:
    """Cameras whose mutual turns are right and whose distances all want one factor."""
    ratios = []
    for evidence in told:
        if evidence.first is None:
            return None
        known = poses[evidence.first] @ invert(poses[evidence.second])
        off = log_rotation(known[:3, :3] @ evidence.T_first_second[:3, :3].T)
        size = float(np.linalg.norm(evidence.T_first_second[:3, 3]))
        if float(np.linalg.norm(off)) > _SAME_TURN_RAD or size <= 0.0:
            return None
        ratios.append(float(np.linalg.norm(known[:3, 3])) / size)
    low, high = min(ratios), max(ratios)
    fits = _SIZE_RANGE[0] < low <= high < _SIZE_RANGE[1] and high / low < 1.0 + _SAME_SIZE
    if not fits or abs(np.mean(ratios) - 1.0) < _SAME_SIZE:
        return None
    return (
        f". It fits when everything in target.toml is {np.mean(ratios):.3f} times as large: check "
        "size_m, or the unit of the calibration"
    )
