"""Reprojection residuals of a camera rig and their normal equations, block by block.

Unknowns of camera c, in this order: lens parameters (k), pose (dt, dr as in `calib.camera.Camera`),
clock offset, line time. After the cameras come three numbers of the board's shape (`shape_modes`)
and the base points.
Every moment has a board pose of its own, tangent (dt, dr) in the base frame: t + dt, exp(dr) R.

A corner seen at stamp t is moved to the moment t_m by its image velocity before it is compared:
residual = pixel - velocity (lag + clock_offset + row line_time) - projection.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from calib.camera import Camera
from calib.camera_models import Array
from calib.views import FixedPoints, Views
from cdpr.rotation import exp_rotation

POSE = 6
CLOCK = 2
WARP = 3


@dataclass(frozen=True, slots=True)
class Scene:
    """An estimate of everything.

    Attributes:
        cameras: the rig.
        T_base_boards: board poses, (n_moments, 4, 4).
        warp_m: the board's sag along x and along y at its middle, and its tags' growth, (3,).
        base_points_m: the fixed points, (n, 3).
    """

    cameras: tuple[Camera, ...]
    T_base_boards: Array
    warp_m: Array
    base_points_m: Array


def camera_slices(cameras: tuple[Camera, ...]) -> list[slice]:
    """Where each camera's unknowns stand in the vector of shared unknowns."""
    sizes = [len(camera.params) + POSE + CLOCK for camera in cameras]
    ends = np.cumsum(sizes)
    return [slice(int(end - size), int(end)) for size, end in zip(sizes, ends, strict=True)]


def shape_modes(board_points_m: Array) -> Array:
    """How a board differs from its drawing: derivative of its points by `warp_m`, (n, 3, 3).

    Two are a paraboloid, zero on the middles of the edges: z changes by 1 - u^2 with u from -1 to 1
    (mrcal's model). The third moves every tag's corners away from its middle, half of it along each
    side: ink that spread, or a marker of another size than stated. It is zero without tags.
    """
    return _shape_modes(np.ascontiguousarray(board_points_m, dtype=np.float64).tobytes())


@lru_cache(maxsize=8)
def _shape_modes(points: bytes) -> Array:
    plane = np.frombuffer(points).reshape(-1, 3)[:, :2]
    low, high = plane.min(axis=0), plane.max(axis=0)
    half = np.maximum(0.5 * (high - low), 1e-12)
    modes = np.zeros((len(plane), 3, WARP))
    modes[:, 2, :2] = 1.0 - ((plane - 0.5 * (low + high)) / half) ** 2
    if len(plane) % 4 == 0:
        tags = plane.reshape(-1, 4, 2)
        arms = tags - tags.mean(axis=1, keepdims=True)
        reach = np.linalg.norm(arms, axis=-1, keepdims=True)
        if np.allclose(arms[:, :2], -arms[:, 2:]) and np.allclose(reach, reach[0, 0, 0]):
            modes[:, :2, 2] = (arms / (np.sqrt(2.0) * reach)).reshape(-1, 2)
    modes.flags.writeable = False
    return modes


def warped(board_points_m: Array, warp_m: Array) -> Array:
    """Board points with the board's true shape applied, (n, 3)."""
    return board_points_m + shape_modes(board_points_m) @ warp_m


def board_residuals(scene: Scene, board_points_m: Array, views: Views, index: int) -> Array:
    """Residuals of one camera's views in pixels, (n, n_points, 2), NaN where unseen."""
    camera = scene.cameras[index]
    points = warped(board_points_m, scene.warp_m)
    T = camera.T_camera_base @ scene.T_base_boards[views.moment]
    in_camera = points @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3]
    return _measured(camera, views) - camera.project(in_camera)


def fixed_residuals(scene: Scene, fixed: FixedPoints) -> Array:
    """Residuals of the fixed points' sightings in pixels, (m, 2)."""
    residuals = np.empty_like(fixed.pixels)
    for index, camera in enumerate(scene.cameras):
        own = fixed.camera == index
        points = camera.to_camera(scene.base_points_m[fixed.point[own]])
        residuals[own] = fixed.pixels[own] - camera.project(points)
    return residuals


def _measured(camera: Camera, views: Views) -> Array:
    """Corner pixels carried to the moment by their velocity."""
    delay = views.lag_s[:, None] + camera.clock_offset_s + views.pixels[..., 1] * camera.line_time_s
    return views.pixels - views.velocity_px_s * delay[..., None]


def board_jacobians(
    scene: Scene, board_points_m: Array, views: Views, index: int
) -> tuple[Array, Array, Array, Array]:
    """Residuals and minus their derivatives, of one camera's views.

    Returns:
        Residuals (n, n_points, 2); derivatives of the projection by the camera's unknowns
        (n, n_points, 2, k + 8), by the board pose (..., 6) and by the warp (..., 2).
    """
    camera = scene.cameras[index]
    points = warped(board_points_m, scene.warp_m)
    poses = scene.T_base_boards[views.moment]
    R_camera_base = camera.T_camera_base[:3, :3]
    turned = points @ np.swapaxes(poses[:, :3, :3], 1, 2)  # base axes, from the board's origin
    in_base = turned + poses[:, None, :3, 3]
    arm = in_base @ R_camera_base.T  # camera axes, from the base's origin
    pixels, d_point, d_params = camera.project_jacobian(arm + camera.T_camera_base[:3, 3])
    k = len(camera.params)
    d_camera = np.empty((*pixels.shape, k + POSE + CLOCK))
    d_camera[..., :k] = d_params
    d_camera[..., k : k + 3] = d_point
    d_camera[..., k + 3 : k + 6] = _cross(arm[..., None, :], d_point)
    d_camera[..., k + 6] = views.velocity_px_s
    d_camera[..., k + 7] = views.velocity_px_s * views.pixels[..., 1:]
    d_base = d_point @ R_camera_base
    d_board = np.empty((*pixels.shape, POSE))
    d_board[..., :3] = d_base
    d_board[..., 3:] = _cross(turned[..., None, :], d_base)
    d_warp = d_base @ poses[:, None, :3, :3] @ shape_modes(board_points_m)
    return _measured(camera, views) - pixels, d_camera, d_board, d_warp


def fixed_jacobians(scene: Scene, fixed: FixedPoints, index: int) -> tuple[Array, Array, Array]:
    """Residuals (m, 2) of one camera's fixed points, derivatives by camera and by the point."""
    camera = scene.cameras[index]
    arm = scene.base_points_m[fixed.point] @ camera.T_camera_base[:3, :3].T
    pixels, d_point, d_params = camera.project_jacobian(arm + camera.T_camera_base[:3, 3])
    rotation = _cross(arm[..., None, :], d_point)
    clock = np.zeros((*pixels.shape, CLOCK))
    d_camera = np.concatenate([d_params, d_point, rotation, clock], axis=-1)
    return fixed.pixels - pixels, d_camera, d_point @ camera.T_camera_base[:3, :3]


def moved(scene: Scene, shared: Array, boards: Array) -> Scene:
    """The scene after a step of the shared unknowns (p,) and of the boards (n_moments, 6)."""
    cameras = []
    slices = camera_slices(scene.cameras)
    for camera, own in zip(scene.cameras, slices, strict=True):
        k = len(camera.params)
        step = shared[own]
        cameras.append(
            replace(
                camera,
                params=camera.params + step[:k],
                T_camera_base=_moved_pose(camera.T_camera_base, step[k : k + POSE]),
                clock_offset_s=camera.clock_offset_s + float(step[k + POSE]),
                line_time_s=camera.line_time_s + float(step[k + POSE + 1]),
            )
        )
    end = slices[-1].stop
    return Scene(
        tuple(cameras),
        _moved_pose(scene.T_base_boards, boards),
        scene.warp_m + shared[end : end + WARP],
        scene.base_points_m + shared[end + WARP :].reshape(-1, 3),
    )


def _moved_pose(T: Array, step: Array) -> Array:
    moved_T = np.array(T)
    moved_T[..., :3, :3] = exp_rotation(step[..., 3:]) @ T[..., :3, :3]
    moved_T[..., :3, 3] += step[..., :3]
    return moved_T


def _cross(a: Array, b: Array) -> Array:
    """Cross product along the last axis; several times faster than numpy's own."""
    return np.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        axis=-1,
    )
