"""A calibration beside COLMAP's own bundle adjustment of the same corners.

COLMAP sees the cameras as a rig that moves about a board at rest: one frame a moment, the board's
corners known points. It knows no clocks, no readout and no weights of corners, so corners are
carried to one instant first, and its result scatters a little more than ours.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from freeswing.calib.board.board_pose import best_poses
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import PARAMETER_NAMES, Array, focal_and_centre
from freeswing.calib.rig.reprojection import camera_slices, warped
from freeswing.calib.rig.solve_rig import Rig
from freeswing.calib.verdict.halves_and_lengths import at_moment
from freeswing.cdpr.rotation import invert, log_rotation

HALF_PIXEL = 0.5
# Deviations of ours between the two: unweighted corners may double the scatter, twice that is a
# difference of the algebra, not of the weights.
MOST_DEVIATIONS = 4.0
# Relative focal lengths that differ less than this have no consequence anywhere: 0.1 mm in 1 m.
LEAST_FOCAL = 1e-4


@dataclass(frozen=True, slots=True)
class Beside:
    """One camera by COLMAP less the same by us.

    Attributes:
        camera: its name.
        focal: relative difference of the focal length.
        focal_std: our standard deviation of it.
        centre_px: distance of the principal points.
        place_mm: distance between its places in the first camera's frame.
        turn_mrad: angle between its directions there.
    """

    camera: str
    focal: float
    focal_std: float
    centre_px: float
    place_mm: float
    turn_mrad: float

    @property
    def agrees(self) -> bool:
        """Whether the difference is within what other weights do."""
        return abs(self.focal) <= max(MOST_DEVIATIONS * self.focal_std, LEAST_FOCAL)


def beside_colmap(rig: Rig) -> tuple[Beside, ...]:
    """Both solutions compared, camera by camera.

    Raises:
        ValueError: where COLMAP comes to no result.
    """
    ours, slices = rig.cameras, camera_slices(rig.cameras)
    theirs = _adjusted(rig)
    found = []
    for camera, other, own in zip(ours, theirs, slices, strict=True):
        one, centre = focal_and_centre(camera.model, camera.params)
        two, other_centre = focal_and_centre(other.model, other.params)
        std = float(np.sqrt(rig.adjustment.covariance[own.start, own.start])) / float(one[0])
        first, second = (
            invert(c.T_camera_base @ invert(cameras[0].T_camera_base))
            for c, cameras in ((camera, ours), (other, theirs))
        )
        found.append(
            Beside(
                camera.name,
                float((two / one).mean() - 1.0),
                std,
                float(np.linalg.norm(other_centre - centre)),
                1e3 * float(np.linalg.norm(second[:3, 3] - first[:3, 3])),
                1e3 * float(np.linalg.norm(log_rotation(second[:3, :3] @ first[:3, :3].T))),
            )
        )
    return tuple(found)


def document(found: tuple[Beside, ...]) -> list[dict[str, Any]]:
    """`beside_colmap` of results/calibration.json."""
    return [{**asdict(one), "agrees": one.agrees} for one in found]


def complaints(found: tuple[Beside, ...]) -> list[str]:
    """A sentence for each camera that does not agree."""
    return [
        f"camera {one.camera}: COLMAP's focal length is {100 * one.focal:+.3f} % off ours, more "
        f"than {MOST_DEVIATIONS:g} deviations of {100 * one.focal_std:.3f} %: do not trust either "
        "before it is known why"
        for one in found
        if not one.agrees
    ]


def _adjusted(rig: Rig) -> tuple[Camera, ...]:
    """The cameras by COLMAP's bundle adjustment, started at ours."""
    import pycolmap

    model, config = _model(rig), pycolmap.BundleAdjustmentConfig()
    for image_id in model.reg_image_ids():
        config.add_image(image_id)
    for point_id in model.point3D_ids():
        config.add_constant_point(point_id)
    for sensor_id in range(2, len(rig.cameras) + 1):
        config.set_variable_sensor_from_rig_pose(_sensor(sensor_id))
    options = pycolmap.BundleAdjustmentOptions()
    options.refine_principal_point = True
    options.refine_points3D = False
    options.print_summary = False
    summary = pycolmap.create_default_bundle_adjuster(options, config, model).solve()
    if not summary.is_solution_usable():
        raise ValueError("COLMAP's bundle adjustment came to no result")
    return tuple(_camera(model, number, own) for number, own in enumerate(rig.cameras, start=1))


def _sensor(number: int) -> Any:
    import pycolmap

    return pycolmap.sensor_t(type=pycolmap.SensorType.CAMERA, id=number)


def _centre(model: str) -> list[int]:
    return [PARAMETER_NAMES[model].index(name) for name in ("cx", "cy")]


def _camera(model: Any, number: int, own: Camera) -> Camera:
    params = np.array(model.camera(number).params)
    params[_centre(own.model)] -= HALF_PIXEL
    pose = np.eye(4)
    if number > 1:
        pose[:3] = model.rig(1).sensor_from_rig(_sensor(number)).matrix()
    return Camera(own.name, own.size_px, own.model, params, pose)


def _model(rig: Rig) -> Any:
    """The rig, its moments as frames and the board's corners as points."""
    import pycolmap

    model, scene, views = pycolmap.Reconstruction(), rig.adjustment.scene, rig.problem.views
    first = rig.cameras[0].T_camera_base
    own = pycolmap.Rig(rig_id=1)
    for number, camera in enumerate(rig.cameras, start=1):
        params = np.array(camera.params)
        params[_centre(camera.model)] += HALF_PIXEL
        width, height = camera.size_px
        model.add_camera(
            pycolmap.Camera(
                model=camera.model, width=width, height=height, params=params, camera_id=number
            )
        )
        if number == 1:
            own.add_ref_sensor(_sensor(number))
        else:
            relative = camera.T_camera_base @ invert(first)
            own.add_sensor(_sensor(number), pycolmap.Rigid3d(relative[:3]))
    model.add_rig(own)
    points = warped(rig.problem.board_points_m, scene.warp_m)
    pixels = at_moment(scene, rig.problem)
    tracks: dict[int, list[tuple[int, int]]] = {}
    for moment in np.unique(views.moment).tolist():
        _add_moment(model, rig, moment, points, pixels, tracks)
    for corner, seen in sorted(tracks.items()):
        track = pycolmap.Track()
        for image_id, index in seen:
            track.add_element(image_id, index)
        model.add_point3D(points[corner], track)
    return model


def _add_moment(
    model: Any,
    rig: Rig,
    moment: int,
    points: Array,
    pixels: Array,
    tracks: dict[int, list[tuple[int, int]]],
) -> None:
    """One frame: its pose from the view with most corners, an image a camera that saw the board."""
    import pycolmap

    views = rig.problem.views
    mine = np.flatnonzero(views.moment == moment)
    best = mine[np.argmax(np.isfinite(pixels[mine, :, 0]).sum(axis=1))]
    camera = rig.cameras[views.camera[best]]
    T_camera_board = best_poses(camera, points, pixels[best][None])[0]
    if not np.isfinite(T_camera_board).all():
        return
    T_rig_board = rig.cameras[0].T_camera_base @ invert(camera.T_camera_base) @ T_camera_board
    frame = pycolmap.Frame(frame_id=moment + 1, rig_id=1)
    frame.rig_from_world = pycolmap.Rigid3d(T_rig_board[:3])
    images = []
    for view in mine.tolist():
        number, image_id = int(views.camera[view]) + 1, view + 1
        corners = np.flatnonzero(np.isfinite(pixels[view, :, 0]))
        image = pycolmap.Image(
            name=f"{rig.cameras[number - 1].name}/{moment}.png",
            points2D=pycolmap.Point2DList(
                [pycolmap.Point2D(xy) for xy in pixels[view, corners] + HALF_PIXEL]
            ),
            camera_id=number,
            image_id=image_id,
            frame_id=moment + 1,
        )
        frame.add_data_id(image.data_id)
        images.append(image)
        for index, corner in enumerate(corners.tolist()):
            tracks.setdefault(corner, []).append((image_id, index))
    model.add_frame(frame)
    for image in images:
        model.add_image(image)
    model.register_frame(moment + 1)
