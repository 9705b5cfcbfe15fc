"""The map in metres and in the base frame, by surveyed points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.bundle_adjustment import adjust
from freeswing.calib.rig.reprojection import camera_slices
from freeswing.calib.rig.reprojection_kernels import POSE, WARP
from freeswing.calib.rig.solve_rig import Rig
from freeswing.calib.rig.triangulation import triangulate
from freeswing.calib.rig.views import FixedPoints
from freeswing.calib.scene.scene_rig import scaled
from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.rotation import transform

# Of the whole survey's extent: points nearer to one line leave the turn about it open.
LEAST_BREADTH = 0.05


def similarity(source: Array, target: Array) -> tuple[float, Array]:
    """Scale s and T (4, 4) with target = R (s source) + t of least squares.

    Raises:
        DataError: fewer than three points, or all near one line.

    Source:
        Umeyama 1991, Least-squares estimation of transformation parameters.
    """
    spread = np.linalg.svd(target - target.mean(axis=0), compute_uv=False)
    if len(target) < 3 or spread[1] < LEAST_BREADTH * spread[0]:
        raise DataError(
            f"{len(target)} surveyed points can be placed in the map, need three that are not on "
            "one line, each in two images: survey more of them, or take stills that show them"
        )
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    left, values, right = np.linalg.svd(b.T @ a)
    flip = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    turn = (left * flip) @ right
    scale = float(values @ flip / np.sum(a**2))
    return scale, transform(turn, target.mean(axis=0) - scale * turn @ source.mean(axis=0))


def placed_points(rig: Rig, fixed: FixedPoints) -> Array:
    """The fixed points where the images see them, in the rig's frame, NaN where fewer than two."""
    pixels = np.full((len(rig.cameras), len(fixed.points_base_m), 2), np.nan)
    pixels[fixed.camera, fixed.point] = fixed.pixels
    return triangulate(rig.cameras, pixels)


def roughly_in_base(rig: Rig, fixed: FixedPoints) -> Rig:
    """The rig moved and scaled onto the survey; nothing is adjusted yet.

    Raises:
        DataError: the survey does not determine it.
    """
    places = placed_points(rig, fixed)
    good = np.isfinite(places[:, 0])
    scale, T_base_rig = similarity(places[good], fixed.points_base_m[good])
    rig = scaled(rig, scale)
    back = np.linalg.inv(T_base_rig)
    scene = rig.adjustment.scene
    cameras = tuple(replace(c, T_camera_base=c.T_camera_base @ back) for c in scene.cameras)
    scene = replace(scene, cameras=cameras, T_base_boards=T_base_rig @ scene.T_base_boards)
    return replace(rig, adjustment=replace(rig.adjustment, scene=scene))


def tied_to_survey(rig: Rig, fixed: FixedPoints) -> Rig:
    """The rig, roughly in the base frame, adjusted together with the surveyed points."""
    end = camera_slices(rig.cameras)[-1].stop + WARP
    free = np.concatenate([rig.problem.free[:end], np.ones(3 * len(fixed.names), dtype=bool)])
    for camera, own in zip(rig.cameras, camera_slices(rig.cameras), strict=True):
        first = own.start + len(camera.params)
        free[first : first + POSE] = True
    return adjusted_beside(rig, fixed, free)


def adjusted_beside(rig: Rig, fixed: FixedPoints, free: np.ndarray) -> Rig:
    """The rig adjusted again beside fixed points, with these unknowns free."""
    scene = replace(rig.adjustment.scene, base_points_m=fixed.points_base_m.copy())
    problem = replace(rig.problem, fixed=fixed, free=free)
    result = adjust(scene, problem, rig.adjustment.sigma_px, rounds=1)
    return replace(rig, adjustment=result, problem=problem)
