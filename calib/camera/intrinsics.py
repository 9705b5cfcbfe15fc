"""One camera alone: a start for its lens and board poses, bad views named and dropped."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.calib.board.board_pose import best_poses, view_errors
from freeswing.calib.board.planar_pose import (
    board_poses,
    focal_guess,
    homographies,
)
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import FISHEYE, PARAMETER_NAMES, Array
from freeswing.calib.camera.off_plane_views import DroppedView, drop_false_boards
from freeswing.calib.rig.bundle_adjustment import ROUGHLY_CONVERGED, Adjustment, adjust
from freeswing.calib.rig.normal_equations import Problem
from freeswing.calib.rig.reprojection import Scene
from freeswing.calib.rig.reprojection_kernels import CLOCK, POSE, WARP
from freeswing.calib.rig.views import Views
from freeswing.cdpr.files.documents import DataError

LEAST_VIEWS = 4  # three tell five numbers of a lens (Zhang 2000, sec. 3.1); one more checks
_FOCAL_STARTS = (0.5, 0.8, 1.2, 2.0)
_FISHEYE_STARTS = (0.3, 0.4, 0.5, 0.7)
_GOOD_PX = 1.0  # detection leaves a tenth: what is above is looked for from other focal lengths
_START_VIEWS = 16


@dataclass(frozen=True, slots=True)
class CameraStart:
    """A camera on its own.

    Attributes:
        camera: lens found, T_camera_base the identity.
        T_camera_boards: pose of the board in every view, (n, 4, 4).
        views: the views kept, all of camera 0.
        dropped: views left out.
        rms_px: reprojection error, each axis.
    """

    camera: Camera
    T_camera_boards: Array
    views: Views
    dropped: tuple[DroppedView, ...]
    rms_px: float


def start_camera(
    name: str, size_px: tuple[int, int], model: str, board_points_m: Array, views: Views
) -> CameraStart:
    """Calibrate one camera's lens from its own views of the board.

    Args:
        name: the camera.
        size_px: image size.
        model: lens model.
        board_points_m: the board's corners, (n_points, 3).
        views: sightings of this camera.

    Raises:
        DataError: when too few views remain.
    """
    views, dropped = drop_false_boards(board_points_m, views)
    _require(name, len(views), len(dropped))
    # a subset settles the lens; every view then gets its pose
    few = np.unique(np.linspace(0, len(views) - 1, _START_VIEWS).round().astype(int))
    best = _best_lens(name, size_px, model, board_points_m, _alone(views.select(few)))
    camera = best.scene.cameras[0]
    poses = best_poses(camera, board_points_m, views.pixels)
    good = np.isfinite(poses[:, 0, 0])
    dropped += tuple(
        DroppedView(views.label[i], np.inf, 0.0, "no pose fits") for i in np.flatnonzero(~good)
    )
    views, poses = views.select(good), poses[good]
    errors = view_errors(camera, board_points_m, poses, views.pixels)
    return CameraStart(camera, poses, views, dropped, float(np.median(errors)))


def _best_lens(
    name: str, size_px: tuple[int, int], model: str, board_points_m: Array, views: Views
) -> Adjustment:
    """Adjust from one focal length after the other until one fits; the best of them all."""
    centre = (np.array(size_px, dtype=float) - 1.0) / 2.0
    matrices = homographies(board_points_m[:, :2], views.pixels)
    guess = focal_guess(matrices[np.isfinite(matrices[:, 0, 0])], centre)
    width = float(max(size_px))
    others = _FISHEYE_STARTS if model == FISHEYE else _FOCAL_STARTS
    best: Adjustment | None = None
    for focal in (guess, *(share * width for share in others)):
        if not 0.1 * width < focal < 50.0 * width:
            continue
        trial = _adjust_lens(_plain_camera(name, size_px, model, focal), board_points_m, views)
        if trial is not None and (best is None or trial.sigma_px[0] < best.sigma_px[0]):
            best = trial
        if best is not None and best.sigma_px[0] < _GOOD_PX:
            return best
    if best is None:
        raise DataError(
            f"camera {name}: no focal length from {0.1 * width:.0f} to {50 * width:.0f} px fits "
            f"its {len(views)} views of the board; check the board's numbers in session.toml"
        )
    return best


def _adjust_lens(camera: Camera, board_points_m: Array, views: Views) -> Adjustment | None:
    poses = board_poses(camera, board_points_m[:, :2], views.pixels)
    good = np.isfinite(poses[:, 0, 0])
    if good.sum() < LEAST_VIEWS:
        return None
    kept, _ = views.select(good).compacted()
    free = np.zeros(len(camera.params) + POSE + CLOCK + WARP, dtype=bool)
    free[: len(camera.params)] = True
    scene = Scene((camera,), poses[good], np.zeros(WARP), np.zeros((0, 3)))
    problem = Problem(board_points_m, kept, None, free)
    result = adjust(scene, problem, rounds=1, converged=ROUGHLY_CONVERGED)
    return result if np.isfinite(result.cost) else None


def _plain_camera(name: str, size_px: tuple[int, int], model: str, focal: float) -> Camera:
    centre = (np.array(size_px, dtype=float) - 1.0) / 2.0
    values = {"f": focal, "fx": focal, "fy": focal, "cx": centre[0], "cy": centre[1]}
    params = np.array([values.get(key, 0.0) for key in PARAMETER_NAMES[model]])
    return Camera(name, size_px, model, params, np.eye(4))


def _alone(views: Views) -> Views:
    """The views as those of camera 0, each its own moment."""
    each = np.arange(len(views))
    return replace(views, camera=np.zeros(len(views), dtype=int), moment=each, piece=each)


def _require(name: str, count: int, n_dropped: int) -> None:
    if count < LEAST_VIEWS:
        raise DataError(
            f"camera {name}: {count} usable views of the board ({n_dropped} false ones dropped), "
            f"needs at least {LEAST_VIEWS}; film the whole board in this camera at several tilts"
        )
