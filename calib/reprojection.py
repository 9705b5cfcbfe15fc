"""Reprojection residuals of a camera rig and their normal equations, block by block.

Unknowns of camera c, in this order: lens parameters (k), pose (dt, dr as in `calib.camera.Camera`),
clock offset, line time. After the cameras come two numbers of board warp and the base points.
Every moment has a board pose of its own, tangent (dt, dr) in the base frame: t + dt, exp(dr) R.

A corner seen at stamp t is moved to the moment t_m by its image velocity before it is compared:
residual = pixel - velocity (lag + clock_offset + row line_time) - projection.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from calib.camera import Camera
from calib.camera_models import Array
from calib.views import FixedPoints, Views
from cdpr.rotation import exp_rotation

POSE = 6
CLOCK = 2
WARP = 2


@dataclass(frozen=True, slots=True)
class Scene:
    """An estimate of everything.

    Attributes:
        cameras: the rig.
        T_base_boards: board poses, (n_moments, 4, 4).
        warp_m: sag of the board along its x and y at the middle, (2,).
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


def warp_shape(board_points_m: Array) -> Array:
    """Derivative of a board point's height by the two warp numbers, (n, 2).

    A paraboloid that is zero on the edges' middles: 1 - u^2 with u from -1 to 1 (mrcal's model).
    """
    plane = board_points_m[:, :2]
    low, high = plane.min(axis=0), plane.max(axis=0)
    half = np.maximum(0.5 * (high - low), 1e-12)
    return 1.0 - ((plane - 0.5 * (low + high)) / half) ** 2


def warped(board_points_m: Array, warp_m: Array) -> Array:
    """Board points with the warp applied, (n, 3)."""
    points = board_points_m.copy()
    points[:, 2] += warp_shape(board_points_m) @ warp_m
    return points


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
    normal = np.einsum("nprc,nc->npr", d_base, poses[:, :3, 2])
    d_warp = normal[..., None] * warp_shape(board_points_m)[None, :, None, :]
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
