"""Is the lens model too small or too large for the data? Views that were not fitted decide.

Each camera's lens is fitted with the next smaller and the next larger model too, on one half of
its views and then on the other; every view is predicted by the lens of the half without it, its
board's pose alone refitted. Views are compared in pairs, so that a difference counts only when it
stands out of what differs from view to view.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freeswing.calib.board.motion_pieces import boards_at
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import PARAMETER_NAMES, Array
from freeswing.calib.rig.bundle_adjustment import ROUGHLY_CONVERGED, adjust
from freeswing.calib.rig.normal_equations import Problem
from freeswing.calib.rig.reprojection import Scene
from freeswing.calib.rig.solve_rig import Rig, free_unknowns
from freeswing.calib.rig.views import Views
from freeswing.calib.verdict.halves_and_lengths import at_moment

LADDER = ("PINHOLE", "OPENCV", "FULL_OPENCV")
LEAST_VIEWS = 12  # six a half: a lens of eight numbers from 48 corners each and more
_MOST_VIEWS = 60
_SIGMAS = 3.0  # of what differs from view to view: one camera in 700 is advised by chance
_LEAST_GAIN = 0.02  # of the square error: less is not worth another calibration


@dataclass(frozen=True, slots=True)
class LensChoice:
    """One camera's lens models on views not fitted.

    Attributes:
        held_out_px: error by model, each axis; empty when there is too little to compare.
        advice: the model that predicts better than the one used, empty when none does.
    """

    held_out_px: dict[str, float]
    advice: str


def weigh_lenses(rig: Rig) -> tuple[LensChoice, ...]:
    """Compare every camera's model with its neighbours on the ladder of models."""
    views = replace(rig.problem.views, pixels=at_moment(rig.adjustment.scene, rig.problem))
    return tuple(_weigh(rig, index, views) for index in range(len(rig.cameras)))


def lens_warnings(cameras: tuple[Camera, ...], choices: tuple[LensChoice, ...]) -> list[str]:
    """What to say of cameras whose model is not the best."""
    return [
        f"camera {camera.name}: on views not used {camera.model} leaves "
        f"{choice.held_out_px[camera.model]:.3g} px and {choice.advice} "
        f"{choice.held_out_px[choice.advice]:.3g} px: calibrate with --model {choice.advice}"
        for camera, choice in zip(cameras, choices, strict=True)
        if choice.advice
    ]


def _weigh(rig: Rig, index: int, views: Views) -> LensChoice:
    camera = rig.cameras[index]
    own = np.flatnonzero(views.camera == index)
    if camera.model not in LADDER or len(own) < LEAST_VIEWS:
        return LensChoice({}, "")
    own = own[np.unique(np.linspace(0, len(own) - 1, _MOST_VIEWS).round().astype(int))]
    place = LADDER.index(camera.model)
    squares = {
        model: _held_out(rig, camera, model, views.select(own))
        for model in LADDER[max(place - 1, 0) : place + 2]
    }
    used = squares[camera.model]
    held_out = {model: float(np.sqrt(np.mean(value))) for model, value in squares.items()}
    best, advice = 0.0, ""
    for model, value in squares.items():
        gain = used - value
        spread = float(np.std(gain)) / np.sqrt(len(gain))
        share = float(np.mean(gain) / np.mean(used))
        if np.mean(gain) > _SIGMAS * spread and share > max(best, _LEAST_GAIN):
            best, advice = share, model
    return LensChoice(held_out, advice)


def _held_out(rig: Rig, camera: Camera, model: str, views: Views) -> Array:
    """Mean square error of each view by the lens of the views of the other parity, px^2, (n,)."""
    scene = rig.adjustment.scene
    rows = np.arange(len(views))
    times = views.lag_s + camera.clock_offset_s
    poses = camera.T_camera_base @ boards_at(scene, views.piece, times)
    values = dict(zip(PARAMETER_NAMES[camera.model], camera.params, strict=True))
    params = np.array([values.get(name, 0.0) for name in PARAMETER_NAMES[model]])
    lens = Camera(camera.name, camera.size_px, model, params, np.eye(4))
    alone = replace(views, camera=0 * rows, moment=rows, piece=rows)
    sigma = rig.adjustment.sigma_px[views.camera[:1]]
    held, known = np.zeros(len(scene.warp_m), dtype=bool), np.full(len(scene.warp_m), np.inf)
    result = np.zeros(len(views))
    for parity in (0, 1):
        found = lens
        for half, learn in ((rows % 2 != parity, True), (rows % 2 == parity, False)):
            free = free_unknowns((found,), held_pose=0, held_lenses=not learn, warp=held)
            kept, _ = alone.select(half).compacted()
            problem = Problem(rig.problem.board_points_m, kept, None, free, known)
            start = Scene((found,), poses[half], scene.warp_m, np.zeros((0, 3)))
            fit = adjust(start, problem, sigma, rounds=1, converged=ROUGHLY_CONVERGED)
            found = fit.scene.cameras[0]
        result[half] = np.nanmean(fit.residuals_px**2, axis=(1, 2))
    return result
