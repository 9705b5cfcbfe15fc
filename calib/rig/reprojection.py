"""Unknowns of a camera rig and their reprojection residuals.

Unknowns of camera c, in this order: lens parameters (k), pose (dt, dr as in
`calib.camera.camera.Camera`), clock offset, line time. After the cameras come the numbers of the
shapes (`shape_modes`): three of the board's, six of each tag of the platform; then the base points.
Every piece of a recording has a board motion of its own (`calib.rig.reprojection_kernels`): the
pose at its middle, tangent (dt, dr) in the base frame: t + dt, exp(dr) R, then the motion's
coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import FISHEYE, Array, full_parameters, parameter_columns
from freeswing.calib.rig.kernel_inputs import Boards, Estimate, Lenses, Places, Shape, ViewArrays
from freeswing.calib.rig.reprojection_kernels import CLOCK, POSE, WARP, all_residuals
from freeswing.calib.rig.views import FixedPoints, Views
from freeswing.cdpr.rotation import exp_rotation


@dataclass(frozen=True, slots=True)
class Scene:
    """An estimate of everything.

    Attributes:
        cameras: the rig.
        T_base_boards: board poses at the middles of the pieces, (n_pieces, 4, 4).
        warp_m: the board's sag along x and along y at its middle, its tags' growth, and where the
            platform's tags are beside their drawing, (3 + 6 n_tags,).
        base_points_m: the fixed points, (n, 3).
        motion: shift and turn by the powers of time over `motion_scale_s`, from the first,
            (n_pieces, degree, 6); a board at rest when left out.
        motion_scale_s: the unit of time of `motion`.
    """

    cameras: tuple[Camera, ...]
    T_base_boards: Array
    warp_m: Array
    base_points_m: Array
    motion: Array = field(default_factory=lambda: np.zeros((0, 0, 6)))
    motion_scale_s: float = 1.0

    def __post_init__(self) -> None:
        if not self.motion.size:
            rest = np.zeros((len(self.T_base_boards), 0, 6))
            object.__setattr__(self, "motion", rest)

    @property
    def board_unknowns(self) -> int:
        """Unknowns of each piece."""
        return 6 * (1 + self.motion.shape[1])

    def pieces(self, keep: np.ndarray) -> Scene:
        """The scene with the pieces picked by a mask or an index array."""
        return replace(self, T_base_boards=self.T_base_boards[keep], motion=self.motion[keep])


def camera_slices(cameras: tuple[Camera, ...]) -> list[slice]:
    """Where each camera's unknowns stand in the vector of shared unknowns."""
    sizes = [len(camera.params) + POSE + CLOCK for camera in cameras]
    ends = np.cumsum(sizes)
    return [slice(int(end - size), int(end)) for size, end in zip(sizes, ends, strict=True)]


def board_size(points_m: Array) -> int:
    """How many points are the board's: those before the first row of NaN."""
    gaps = np.flatnonzero(np.isnan(points_m[:, 0]))
    return int(gaps[0]) if len(gaps) else len(points_m)


def shape_modes(board_points_m: Array) -> Array:
    """How shapes differ from their drawing: derivative of points by `warp_m`, (n, 3, 3 + 6 n_tags).

    Two are a paraboloid, zero on the middles of the edges: z changes by 1 - u^2 with u from -1 to 1
    (mrcal's model). The third moves every tag's corners away from its middle, half of it along each
    side: ink that spread, or a marker of another size than stated. It is zero without tags. Of
    another body (`board_size`) every tag, four points, shifts along three axes and turns about
    them by what moves its corners so far in the mean.
    """
    return _shape_modes(np.ascontiguousarray(board_points_m, dtype=np.float64).tobytes())


@lru_cache(maxsize=8)
def _shape_modes(points: bytes) -> Array:
    everything = np.frombuffer(points).reshape(-1, 3)
    plane = everything[: board_size(everything), :2]
    low, high = plane.min(axis=0), plane.max(axis=0)
    half = np.maximum(0.5 * (high - low), 1e-12)
    body = everything[len(plane) :]
    first = len(plane) + int(np.isnan(body[:, 0]).sum())
    tags_of_body = everything[first:].reshape(-1, 4, 3)
    modes = np.zeros((len(everything), 3, WARP + 6 * len(tags_of_body)))
    for k, corners in enumerate(tags_of_body):
        modes[first + 4 * k : first + 4 * k + 4, :, WARP + 6 * k :][..., :6] = _tag_modes(corners)
    modes[: len(plane), 2, :2] = 1.0 - ((plane - 0.5 * (low + high)) / half) ** 2
    if len(plane) % 4 == 0:
        tags = plane.reshape(-1, 4, 2)
        arms = tags - tags.mean(axis=1, keepdims=True)
        reach = np.linalg.norm(arms, axis=-1, keepdims=True)
        if np.allclose(arms[:, :2], -arms[:, 2:]) and np.allclose(reach, reach[0, 0, 0]):
            modes[: len(plane), :2, 2] = (arms / (np.sqrt(2.0) * reach)).reshape(-1, 2)
    modes.flags.writeable = False
    return modes


def _tag_modes(corners: Array) -> Array:
    """How a tag's corners go with shifts and turns of it, (4, 3, 6)."""
    arms = corners - corners.mean(axis=0)
    turns = np.cross(np.eye(3)[None], arms[:, None])  # (corner, axis of the turn, coordinate)
    reach = np.linalg.norm(arms, axis=-1).mean()
    shifts = np.broadcast_to(np.eye(3), (4, 3, 3))
    return np.concatenate([shifts, np.swapaxes(turns, 1, 2) / reach], axis=2)


def shape_count(board_points_m: Array) -> int:
    """How many numbers `warp_m` has."""
    return shape_modes(board_points_m).shape[2]


def warped(board_points_m: Array, warp_m: Array) -> Array:
    """Board points with the board's true shape applied, (n, 3).

    Source:
        mrcal 2.2, 2022, user's manual: board deformation as a paraboloid (see
        `shape_modes`).
    """
    return board_points_m + shape_modes(board_points_m) @ warp_m


def kernel_estimate(scene: Scene, board_points_m: Array) -> Estimate:
    """The scene as the kernels take it."""
    cameras = scene.cameras
    lenses = Lenses(
        np.array([camera.model == FISHEYE for camera in cameras]),
        np.array([full_parameters(camera.model, camera.params) for camera in cameras]),
        np.array([parameter_columns(camera.model) for camera in cameras]),
        np.array([len(camera.params) for camera in cameras]),
        np.array([own.start for own in camera_slices(cameras)]),
    )
    poses = np.stack([camera.T_camera_base for camera in cameras])
    places = Places(
        np.ascontiguousarray(poses[:, :3, :3]),
        np.ascontiguousarray(poses[:, :3, 3]),
        np.array([[camera.clock_offset_s, camera.line_time_s] for camera in cameras]),
    )
    boards = Boards(
        np.ascontiguousarray(scene.T_base_boards),
        np.ascontiguousarray(scene.motion),
        scene.motion_scale_s,
    )
    shape = Shape(warped(board_points_m, scene.warp_m), shape_modes(board_points_m))
    return Estimate(lenses, places, boards, shape)


def kernel_views(views: Views) -> ViewArrays:
    """The views as the kernels take them."""
    return ViewArrays(views.camera, views.piece, views.pixels, views.lag_s, views.whitening)


def board_residuals(scene: Scene, board_points_m: Array, views: Views) -> Array:
    """Residuals of all views in pixels, (n, n_points, 2), NaN where unseen."""
    return all_residuals(kernel_views(views), kernel_estimate(scene, board_points_m))


def fixed_residuals(scene: Scene, fixed: FixedPoints) -> Array:
    """Residuals of the fixed points' sightings in pixels, (m, 2)."""
    residuals = np.empty_like(fixed.pixels)
    for index, camera in enumerate(scene.cameras):
        own = fixed.camera == index
        points = camera.to_camera(scene.base_points_m[fixed.point[own]])
        residuals[own] = fixed.pixels[own] - camera.project(points)
    return residuals


def fixed_jacobians(scene: Scene, fixed: FixedPoints, index: int) -> tuple[Array, Array, Array]:
    """Residuals (m, 2) of one camera's fixed points, derivatives by camera and by the point.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, appendix 6;
        rotations as by Murray, Li, Sastry 1994, Robotic Manipulation, ch. 2.
    """
    camera = scene.cameras[index]
    arm = scene.base_points_m[fixed.point] @ camera.T_camera_base[:3, :3].T
    pixels, d_point, d_params = camera.project_jacobian(arm + camera.T_camera_base[:3, 3])
    rotation = _cross(arm[..., None, :], d_point)
    clock = np.zeros((*pixels.shape, CLOCK))
    d_camera = np.concatenate([d_params, d_point, rotation, clock], axis=-1)
    return fixed.pixels - pixels, d_camera, d_point @ camera.T_camera_base[:3, :3]


def moved(scene: Scene, shared: Array, boards: Array) -> Scene:
    """The scene after a step of the shared unknowns (p,) and of the boards (n_pieces, b)."""
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
    after = end + len(scene.warp_m)
    return replace(
        scene,
        cameras=tuple(cameras),
        T_base_boards=_moved_pose(scene.T_base_boards, boards[:, :6]),
        warp_m=scene.warp_m + shared[end:after],
        base_points_m=scene.base_points_m + shared[after:].reshape(-1, 3),
        motion=scene.motion + boards[:, 6:].reshape(scene.motion.shape),
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
