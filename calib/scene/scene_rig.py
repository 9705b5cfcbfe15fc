"""The rig from a map: our own adjustment of cameras, lenses and points of the laboratory.

A point of the laboratory is a board of one corner that rests at one moment, an image of the walk a
camera whose lens is that of all others, so that `calib.rig` adjusts it all as it adjusts boards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.bundle_adjustment import ROUGHLY_CONVERGED, adjust
from freeswing.calib.rig.normal_equations import Problem
from freeswing.calib.rig.reprojection import Scene, camera_slices
from freeswing.calib.rig.reprojection_kernels import WARP
from freeswing.calib.rig.solve_rig import Rig, free_unknowns
from freeswing.calib.rig.views import Views, make_views
from freeswing.calib.scene.blob_sizes import feature_variance, small_blobs
from freeswing.calib.scene.chosen_points import agreeing, chosen_points
from freeswing.calib.scene.lab_map import LabMap
from freeswing.calib.scene.stills import Still
from freeswing.cdpr.rotation import invert

_MOST_SWEEPS = 2


def rig_of_map(found: LabMap, stills: Sequence[Still], model: str) -> Rig:
    """The map adjusted in the frame of its first camera, in a scale of its own.

    Cameras of the rig come first, then the walk's images that could be tied in. The first camera
    stands at the identity and one coordinate of the one farthest from it is held: the scale.

    Args:
        found: the map, all cameras of the rig in it.
        stills: what it was made of, cameras of the rig first.
        model: lens model.
    """
    scene, views = _start(found, stills, model)
    fresh = np.array([s.walk for s, tied in zip(stills, found.tied, strict=True) if tied])
    free, equal = _unknowns(scene.cameras, fresh)
    problem = Problem(np.zeros((1, 3)), views, None, free, equal=equal)
    result = adjust(scene, problem, rounds=1, converged=ROUGHLY_CONVERGED)
    trimmed = 0
    for _ in range(_MOST_SWEEPS):
        keep = agreeing(result, problem)
        if keep.all():
            break
        trimmed += int((~keep).sum())
        views, pieces = problem.views.select(keep).compacted()
        problem = replace(problem, views=views)
        result = adjust(result.scene.pieces(pieces), problem, result.sigma_px, 1, ROUGHLY_CONVERGED)
    result = adjust(result.scene, problem, result.sigma_px, rounds=1)
    return Rig(result, problem, 0, (), trimmed)


def _start(found: LabMap, stills: Sequence[Still], model: str) -> tuple[Scene, Views]:
    """The map as `calib.rig` has it: cameras, points as boards, and the sightings chosen.

    Points are numbered by the sizes of their blobs.
    """
    tied = np.flatnonzero(found.tied)
    number = np.full(len(stills), -1)
    number[tied] = np.arange(len(tied))
    first = invert(found.poses[tied[0]])
    cameras = tuple(
        Camera(
            stills[k].name,
            (stills[k].image.shape[1], stills[k].image.shape[0]),
            model,
            found.params[k],
            found.poses[k] @ first,
        )
        for k in tied.tolist()
    )
    small = np.flatnonzero(small_blobs(found.image, found.size_px, found.params[:, 0]))
    _, once = np.unique(
        np.stack([found.image[small], found.point[small]]), axis=1, return_index=True
    )
    once = small[once]
    camera, point, pixels = number[found.image[once]], found.point[once], found.pixels[once]
    variance = feature_variance(found.size_px[once])
    keep = chosen_points(camera, point, np.array([stills[k].walk for k in tied.tolist()]))
    chosen = np.isin(point, keep)
    keep = keep[
        np.argsort(np.bincount(point, found.size_px[once])[keep] / np.bincount(point)[keep])
    ]
    by_size = np.full(int(point.max(initial=-1)) + 1, -1)
    by_size[keep] = np.arange(len(keep))
    views, kept = make_views(
        camera[chosen],
        by_size[point[chosen]],
        pixels[chosen][:, None],
        covariance_px2=variance[chosen][:, None, None, None] * np.eye(2),
        label=tuple(
            f"{cameras[c].name}/{p}" for c, p in zip(camera[chosen], point[chosen], strict=True)
        ),
    ).compacted()
    boards = np.tile(np.eye(4), (len(kept), 1, 1))
    T_first_map = found.poses[tied[0]]
    boards[:, :3, 3] = found.points[keep[kept]] @ T_first_map[:3, :3].T + T_first_map[:3, 3]
    return Scene(cameras, boards, np.zeros(WARP), np.zeros((0, 3))), views


def _unknowns(cameras: tuple[Camera, ...], walk: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which unknowns are free, and which lenses are one."""
    free = free_unknowns(cameras, held_pose=0)
    slices, lens = camera_slices(cameras), len(cameras[0].params)
    t = np.abs([camera.T_camera_base[:3, 3] for camera in cameras])
    farthest, axis = np.unravel_index(int(np.argmax(t)), t.shape)
    free[slices[int(farthest)].start + lens + int(axis)] = False
    carried = np.flatnonzero(walk)
    many = [np.arange(lens) + slices[k].start for k in carried[1:]]
    if not many:
        return free, np.zeros((2, 0), dtype=int)
    followers = np.concatenate(many)
    leaders = np.tile(np.arange(lens) + slices[int(carried[0])].start, len(many))
    free[followers] = False
    return free, np.stack([followers, leaders])


def scaled(rig: Rig, factor: float) -> Rig:
    """The rig with all lengths times `factor`; its covariance is that of the old scale."""
    scene = rig.adjustment.scene

    def longer(T: Array) -> Array:
        moved = np.array(T)
        moved[..., :3, 3] *= factor
        return moved

    cameras = tuple(replace(c, T_camera_base=longer(c.T_camera_base)) for c in scene.cameras)
    scene = replace(
        scene,
        cameras=cameras,
        T_base_boards=longer(scene.T_base_boards),
        base_points_m=scene.base_points_m * factor,
    )
    return replace(rig, adjustment=replace(rig.adjustment, scene=scene))


def rig_part(rig: Rig, count: int) -> Rig:
    """The first `count` cameras alone, with their share of the covariance: what is handed on."""
    result, views = rig.adjustment, rig.problem.views
    cameras = rig.cameras[:count]
    end, before = (camera_slices(some)[-1].stop for some in (cameras, rig.cameras))
    index = np.concatenate([np.arange(end), np.arange(before, len(result.covariance))])
    own = views.camera < count
    fixed = rig.problem.fixed
    seen = None if fixed is None else fixed.camera < count
    problem = replace(
        rig.problem,
        views=views.select(own),
        free=rig.problem.free[index],
        equal=None,
        fixed=fixed if fixed is None or seen is None else fixed.select(seen),
    )
    result = replace(
        result,
        scene=replace(result.scene, cameras=cameras),
        covariance=result.covariance[np.ix_(index, index)],
        weakest=result.weakest[index],
        sigma_px=result.sigma_px[:count],
        residuals_px=result.residuals_px[own],
        fixed_residuals_px=result.fixed_residuals_px
        if seen is None
        else result.fixed_residuals_px[seen],
    )
    return Rig(result, problem, rig.reference, rig.dropped, rig.n_trimmed)
