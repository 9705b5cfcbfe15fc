"""The platform's points put right by the swings themselves: bundle adjustment by turns.

With poses held every point is fitted to all its sightings, then poses are fitted to the points
again; the frame stays that of the named points at rest.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.rotation import exp_rotation
from freeswing.vision.fuse.blocks import blocks
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.untagged.feature_bias import FeatureBias, Placed, feature_bias
from freeswing.vision.untagged.rest_model import RestModel
from freeswing.vision.untagged.still_pose import still_pose

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_INSTANTS = 120  # of each run: more add little to points that each of them shows
_STEPS = 3
_FAR = 0.003  # rad: a sighting farther off than 3 px at f = 1000 px is no sighting of the point


class PointSums:
    """Normal equations of every point's place, (n, 3, 3) and (n, 3)."""

    def __init__(self, points_m: Array) -> None:
        self.points_m = points_m
        self.normal = np.zeros((len(points_m), 3, 3))
        self.slope = np.zeros((len(points_m), 3))

    def add(self, which: NDArray[np.int64], T_camera_platform: Array, rays: Array) -> None:
        """Sightings of points `which` (m,) from poses (m, 4, 4), at rays x/z, y/z (m, 2)."""
        which, off, slope = placed(self.points_m, which, T_camera_platform, rays)
        np.add.at(self.normal, which, np.swapaxes(slope, 1, 2) @ slope)
        np.add.at(self.slope, which, (np.swapaxes(slope, 1, 2) @ off[..., None])[..., 0])

    def moved(self) -> Array:
        """The points after a step; those that too few sightings determine stay, (n, 3)."""
        values = np.linalg.eigvalsh(self.normal)
        known = values[:, 0] > 1e-4 * np.maximum(values[:, 2], 1e-12)
        safe = np.where(known[:, None, None], self.normal, np.eye(3))
        step = np.linalg.solve(safe, self.slope[..., None])[..., 0]
        return self.points_m + np.where(known[:, None], step, 0.0)


def placed(
    points_m: Array, which: Ints, T_camera_platform: Array, rays: Array
) -> tuple[Ints, Array, Array]:
    """Points, residuals and slopes of the sightings that are near, see `feature_bias.Placed`.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, appendix 6.
    """
    turn = T_camera_platform[:, :3, :3]
    at = np.einsum("mij,mj->mi", turn, points_m[which]) + T_camera_platform[:, :3, 3]
    predicted = at[:, :2] / at[:, 2:]
    off = rays - predicted
    slope = (turn[:, :2] - predicted[:, :, None] * turn[:, 2:]) / at[:, 2, None, None]
    near = (at[:, 2] > 0.0) & (np.linalg.norm(off, axis=1) < _FAR)
    return which[near], off[near], slope[near]


def refined_points(
    runs: Sequence[tuple[Sequence[CameraViews], Poses]],
    watch: Watch,
    model: RestModel,
    cameras: Sequence[Camera],
) -> tuple[Array, Array]:
    """The points by all sightings of the runs and at rest, in the named points' frame, (n, 3).

    Beside them the covariance of what the images at rest leave open of that frame, (6, 6).

    Args:
        runs: cameras with their sightings, and the poses found with the points as they are.
        watch: the points as they are.
        model: what was seen at rest.
        cameras: as calibrated.

    Source:
        Hartley, Zisserman 2004, Multiple View Geometry in Computer Vision, appendix 6:
        points by least squares, poses in turn.
    """
    points = watch.marker_positions_m
    for _ in range(_STEPS):
        sums = PointSums(points)
        for views, poses in runs:
            _add_run(sums, views, watch, poses)
        for camera in cameras:
            if camera.name in model.at_rest:
                seen = model.at_rest[camera.name]
                pose = camera.T_camera_base @ model.T_base_rest
                rays = camera.normalise(seen.pixels)
                sums.add(seen.which, np.tile(pose, (len(seen.which), 1, 1)), rays)
        points = sums.moved()
    return at_home(points, model, cameras)


def _add_run(sums: PointSums, views: Sequence[CameraViews], watch: Watch, poses: Poses) -> None:
    for _, which, T_camera_platform, rays in _seen(views, watch, poses):
        sums.add(which, T_camera_platform, rays)


def _seen(
    views: Sequence[CameraViews], watch: Watch, poses: Poses
) -> Iterator[tuple[Ints, Ints, Array, Array]]:
    """Camera, point, T_camera_platform and ray of the sightings at some of a run's instants."""
    few = np.zeros(len(poses.times_s), dtype=bool)
    few[np.unique(np.linspace(0, len(few) - 1, _INSTANTS).round().astype(int))] = True
    few &= poses.known
    cameras = np.array([view.camera.T_camera_base for view in views])
    for block in blocks(views, watch, poses.times_s, poses):
        span = slice(block.first, block.first + len(block.starts) - 1)
        own = np.repeat(np.arange(span.start, span.stop), np.diff(block.starts))
        use = few[own]
        own, shifts = own[use], block.shifts[use]
        T = np.tile(np.eye(4), (len(own), 1, 1))
        T[:, :3, :3] = exp_rotation(shifts[:, 3:]) @ poses.rotations[own]
        T[:, :3, 3] = poses.positions_m[own] + shifts[:, :3]
        camera_of = block.camera_of[use]
        yield (
            camera_of,
            block.things[use] - watch.first_marker,
            cameras[camera_of] @ T,
            block.rays[use, :2],
        )


def bias_of_features(
    runs: Sequence[tuple[Sequence[CameraViews], Poses]], watch: Watch, cameras: Sequence[Camera]
) -> FeatureBias:
    """What features have wrong for good, from all sightings about the points as they are.

    Args:
        runs: as `refined_points` takes them.
        watch: the points.
        cameras: as calibrated.
    """
    names = [camera.name for camera in cameras]
    points = watch.marker_positions_m

    def sightings() -> Iterator[Placed]:
        for views, poses in runs:
            own = np.array([names.index(view.camera.name) for view in views])
            for camera_of, which, T_camera_platform, rays in _seen(views, watch, poses):
                for camera in range(len(views)):
                    mine = camera_of == camera
                    near = placed(points, which[mine], T_camera_platform[mine], rays[mine])
                    yield Placed(int(own[camera]), *near)

    return feature_bias(sightings(), names, len(points))


def at_home(points_m: Array, model: RestModel, cameras: Sequence[Camera]) -> tuple[Array, Array]:
    """Points moved so that at rest they hang where the named points say, and its covariance.

    Source:
        JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement, eq. (13):
        propagation; poses as by Murray, Li, Sastry 1994, A Mathematical Introduction to
        Robotic Manipulation, ch. 2.
    """
    own = [camera for camera in cameras if camera.name in model.at_rest]
    seen = [model.at_rest[camera.name] for camera in own]
    pixels = np.concatenate([one.pixels for one in seen])
    camera_of = np.repeat(np.arange(len(seen)), [len(one.which) for one in seen])
    points = points_m[np.concatenate([one.which for one in seen])]
    std = np.concatenate([one.std_px for one in seen])
    T, covariance = still_pose(own, camera_of, points, pixels, std, model.T_base_rest)
    home = np.linalg.inv(model.T_base_rest) @ T
    return points_m @ home[:3, :3].T + home[:3, 3], covariance
