"""Puts cameras and board poses into one frame through the graph of cameras that share boards."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.reprojection import Scene, shape_count
from freeswing.calib.rig.views import FixedPoints, Views
from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.rotation import invert

# moment: the board's pose in both cameras is the way between them, all six numbers
LEAST_SHARED = 1
_MOST_CANDIDATES = 12
_CAP_PX = 20.0  # more is a pose turned over, whatever it misses by: it has one vote like others


@dataclass(frozen=True, slots=True)
class RigStart:
    """A rig in the frame of its reference camera.

    Attributes:
        scene: the start; the reference camera stands at the identity.
        reference: index of that camera.
        shared: moments that each pair of cameras sees together, (n_cameras, n_cameras).
    """

    scene: Scene
    reference: int
    shared: np.ndarray


@dataclass(frozen=True, slots=True)
class BaseTie:
    """Cameras that share no board, each held by the surveyed tags and points that it sees.

    Attributes:
        fixed: the survey and its sightings.
        T_cameras_base: each camera by its own sightings, None where they do not give a pose.
    """

    fixed: FixedPoints
    T_cameras_base: tuple[Array | None, ...]


def base_tie(cameras: tuple[Camera, ...], fixed: FixedPoints) -> BaseTie:
    """Every camera's pose by the surveyed points that it sees."""
    poses = []
    for index, camera in enumerate(cameras):
        own = fixed.camera == index
        points, pixels = fixed.points_base_m[fixed.point[own]], fixed.pixels[own]
        poses.append(pose_from_points(camera, points, pixels) if own.sum() >= 4 else None)
    return BaseTie(fixed, tuple(poses))


def start_rig(
    cameras: tuple[Camera, ...],
    board_points_m: Array,
    views: Views,
    T_camera_boards: Array,
    tie: BaseTie | None = None,
) -> RigStart:
    """Chain the cameras from the one that shares most with the others.

    What shares no board with them is reached through the survey, where `tie` has it.

    Args:
        cameras: their lenses; poses are ignored.
        board_points_m: the board's corners, (n_points, 3).
        views: all sightings.
        T_camera_boards: board pose of every view in its own camera, (n_views, 4, 4).
        tie: cameras by surveyed tags, where these are needed.

    Raises:
        DataError: when the cameras fall into groups that nothing ties, naming them.
    """
    shared = shared_moments(len(cameras), views)
    reference = int(np.argmax(shared.sum(axis=1)))
    placed = {reference: np.eye(4)}
    while len(placed) < len(cameras):
        inside, outside = sorted(placed), [c for c in range(len(cameras)) if c not in placed]
        counts = shared[np.ix_(inside, outside)]
        if counts.max() < LEAST_SHARED:
            T_tied = _through_base(tie, placed, outside)
            if T_tied is None:
                raise DataError(_apart(cameras, inside, outside, tie))
            placed |= T_tied
            continue
        row, column = np.unravel_index(int(np.argmax(counts)), counts.shape)
        known, new = inside[int(row)], outside[int(column)]
        T_new_known = _relative_pose(cameras, board_points_m, views, T_camera_boards, new, known)
        placed[new] = T_new_known @ placed[known]
    rig = tuple(
        replace(camera, T_camera_base=placed[index]) for index, camera in enumerate(cameras)
    )
    boards = _board_poses(rig, board_points_m, views, T_camera_boards)
    shape = np.zeros(shape_count(board_points_m))
    return RigStart(Scene(rig, boards, shape, np.zeros((0, 3))), reference, shared)


def _through_base(
    tie: BaseTie | None, placed: dict[int, Array], outside: list[int]
) -> dict[int, Array] | None:
    """One more camera, by the tags that it and one already placed see."""
    if tie is None:
        return None
    T = tie.T_cameras_base
    poses = {k: pose for k, pose in enumerate(T) if pose is not None}
    known = next((k for k in placed if k in poses), None)
    new = next((k for k in outside if k in poses), None)
    if known is None or new is None:
        return None
    return {new: poses[new] @ invert(poses[known]) @ placed[known]}


def board_groups(count: int, views: Views) -> np.ndarray:
    """Number of each camera's group: cameras that share boards, also by way of others, (count,)."""
    reach = shared_moments(count, views) >= LEAST_SHARED
    reach |= np.eye(count, dtype=bool)
    for _ in range(count):
        reach = (reach.astype(int) @ reach.astype(int)) > 0
    return np.argmax(reach, axis=1)


def shared_moments(count: int, views: Views) -> np.ndarray:
    """How many moments each pair of cameras sees together, zero on the diagonal."""
    sees = np.zeros((count, int(views.moment.max(initial=-1)) + 1), dtype=int)
    sees[views.camera, views.moment] = 1
    shared = sees @ sees.T
    np.fill_diagonal(shared, 0)
    return shared


def _relative_pose(
    cameras: tuple[Camera, ...], points: Array, views: Views, poses: Array, new: int, known: int
) -> Array:
    """T_new_known: of the poses that single moments give, the one that fits all moments best."""
    ours, theirs = np.flatnonzero(views.camera == new), np.flatnonzero(views.camera == known)
    _, a, b = np.intersect1d(views.moment[ours], views.moment[theirs], return_indices=True)
    ours, theirs = ours[a], theirs[b]
    candidates = poses[ours] @ invert(poses[theirs])
    few = np.unique(np.linspace(0, len(candidates) - 1, _MOST_CANDIDATES).round().astype(int))
    costs = []
    for candidate in candidates[few]:
        forward = candidate @ poses[theirs]
        backward = invert(candidate) @ poses[ours]
        costs.append(
            _capped(cameras[new], points, forward, views.pixels[ours]).sum()
            + _capped(cameras[known], points, backward, views.pixels[theirs]).sum()
        )
    return candidates[few][int(np.argmin(costs))]


def _capped(camera: Camera, points: Array, poses: Array, pixels: Array) -> Array:
    """Mean reprojection distance of every view, at most `_CAP_PX`, (n,)."""
    placed = points @ np.swapaxes(poses[:, :3, :3], 1, 2) + poses[:, None, :3, 3]
    distance = np.linalg.norm(pixels - camera.project(placed), axis=-1)
    seen = np.isfinite(pixels[..., 0])
    distance = np.where(seen, np.nan_to_num(distance, nan=_CAP_PX * 10), 0.0)
    return np.minimum(distance.sum(axis=1) / np.maximum(seen.sum(axis=1), 1), _CAP_PX)


def _board_poses(rig: tuple[Camera, ...], points: Array, views: Views, poses: Array) -> Array:
    """T_base_board of each moment: of the cameras' own answers the one that suits all of them."""
    count = int(views.moment.max()) + 1
    T_base_cameras = invert(np.stack([camera.T_camera_base for camera in rig]))
    options = T_base_cameras[views.camera] @ poses
    best_cost = np.full(count, np.inf)
    result = np.tile(np.eye(4), (count, 1, 1))
    n_cameras = len(rig)
    by_camera = np.full((n_cameras, count), -1)
    by_camera[views.camera, views.moment] = np.arange(len(views))
    for source in range(n_cameras):
        moments = np.flatnonzero(by_camera[source] >= 0)
        proposed = options[by_camera[source, moments]]
        cost = np.zeros(len(moments))
        for judge in range(n_cameras):
            rows = by_camera[judge, moments]
            sees = rows >= 0
            if not sees.any():
                continue
            in_camera = rig[judge].T_camera_base @ proposed[sees]
            cost[sees] += _capped(rig[judge], points, in_camera, views.pixels[rows[sees]])
        better = cost < best_cost[moments]
        result[moments[better]], best_cost[moments[better]] = proposed[better], cost[better]
    return result


def place_in_base(scene: Scene, fixed: FixedPoints) -> Scene:
    """Move the rig, known up to its own frame, onto the surveyed points.

    Raises:
        DataError: when no camera sees four surveyed points.
    """
    candidates = []
    for index, camera in enumerate(scene.cameras):
        own = fixed.camera == index
        if own.sum() < 4:
            continue
        T_camera_base = pose_from_points(
            camera, fixed.points_base_m[fixed.point[own]], fixed.pixels[own]
        )
        if T_camera_base is not None:
            candidates.append(invert(camera.T_camera_base) @ T_camera_base)
    if not candidates:
        raise DataError(
            "no camera sees a base tag or four surveyed points well enough to find itself; film "
            "the base tags too, sharp and at least 20 pixels across, or mark more points"
        )
    costs = [_fixed_cost(scene, fixed, candidate) for candidate in candidates]
    T_rig_base = candidates[int(np.argmin(costs))]
    cameras = tuple(
        replace(camera, T_camera_base=camera.T_camera_base @ T_rig_base) for camera in scene.cameras
    )
    boards = invert(T_rig_base) @ scene.T_base_boards
    turn = T_rig_base[:3, :3]  # from the right: rows of vectors in the rig's frame
    motion = np.concatenate([scene.motion[..., :3] @ turn, scene.motion[..., 3:] @ turn], axis=-1)
    return replace(
        scene,
        cameras=cameras,
        T_base_boards=boards,
        base_points_m=fixed.points_base_m.copy(),
        motion=motion,
    )


def _fixed_cost(scene: Scene, fixed: FixedPoints, T_rig_base: Array) -> float:
    cost = 0.0
    for index, camera in enumerate(scene.cameras):
        own = fixed.camera == index
        T = camera.T_camera_base @ T_rig_base
        points = fixed.points_base_m[fixed.point[own]] @ T[:3, :3].T + T[:3, 3]
        distance = np.linalg.norm(fixed.pixels[own] - camera.project(points), axis=-1)
        cost += float(np.minimum(np.nan_to_num(distance, nan=1e3), 1e3).sum())
    return cost


def pose_from_points(camera: Camera, points_m: Array, pixels: Array) -> Array | None:
    """T_camera_base from four or more known points, OpenCV's solvers; None when they fail.

    Source:
        Collins, Bartoli 2014, Infinitesimal Plane-Based Pose Estimation; for points off a
        plane Terzakis, Lourakis 2020, SQPnP; both as OpenCV has them.
    """
    import cv2

    rays = camera.normalise(pixels)
    good = np.isfinite(rays[:, 0])
    if good.sum() < 4:
        return None
    points, rays = points_m[good], rays[good]
    extent = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    flat = extent[2] < 1e-3 * extent[0]
    method = cv2.SOLVEPNP_IPPE if flat else cv2.SOLVEPNP_SQPNP
    count, turns, shifts, _ = cv2.solvePnPGeneric(
        points, rays[:, None], np.eye(3), None, flags=method
    )
    best: Array | None = None
    best_error = np.inf
    for turn, shift in zip(turns[:count], shifts[:count], strict=True):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = cv2.Rodrigues(turn)[0], np.ravel(shift)
        seen = points @ T[:3, :3].T + T[:3, 3]
        error = float(np.sum((rays - seen[:, :2] / seen[:, 2:]) ** 2))
        if seen[:, 2].min() > 0.0 and error < best_error:
            best, best_error = T, error
    return best


def _apart(
    cameras: tuple[Camera, ...], inside: list[int], outside: list[int], tie: BaseTie | None
) -> str:
    here = ", ".join(cameras[i].name for i in inside)
    there = ", ".join(cameras[i].name for i in outside)
    surveyed = ""
    if tie is not None:
        counts = np.bincount(tie.fixed.camera, minlength=len(cameras))
        seen = ", ".join(f"{camera.name} {n}" for camera, n in zip(cameras, counts, strict=True))
        surveyed = f" (corners and points of the survey seen now: {seen}; four are the least)"
    return (
        f"cameras {there} and cameras {here} share at most {LEAST_SHARED - 1} moments with the "
        f"board or the swinging platform in both, need {LEAST_SHARED}; film the board where one of "
        f"{here} and one of {there} see it at once, or record a swing in which each of these "
        "cameras sees two of the platform's tags (target.toml, a run with video and stamps of one "
        "clock), or survey base tags so that each of these cameras sees two, one a third nearer "
        f"than the other, or six points that are marked in points.csv{surveyed}, or let the "
        "laboratory's looks tie them (calibrate --scene)"
    )
