"""Which points of the laboratory, and which sightings of them, an adjustment keeps."""

from __future__ import annotations

import numpy as np

from freeswing.calib.rig.bundle_adjustment import Adjustment
from freeswing.calib.rig.normal_equations import Problem

# A match that is wrong lies anywhere: 4 deviations leave 1 good sighting in 3000 out.
MATCH_SIGMAS = 4.0
# Seen three times a point tests itself; of two sightings one cannot be told to be wrong.
LEAST_SIGHTINGS = 3
# Points taken from each image, longest tracks first: 600 at 0.3 px place a camera of the rig to
# 0.02 px; images of the walk need only hold together what those see.
POINTS_A_CAMERA = 600
POINTS_A_STILL = 120


def chosen_points(camera: np.ndarray, point: np.ndarray, walk: np.ndarray) -> np.ndarray:
    """The points that are adjusted: of every image the most often seen, sorted.

    Args:
        camera: camera of each sighting, (m,).
        point: point of each, (m,).
        walk: whether a camera is an image of the walk, (n_cameras,).
    """
    sightings = np.bincount(point)
    chosen: set[int] = set()
    for index, carried in enumerate(walk):
        own = point[camera == index]
        own = own[sightings[own] >= LEAST_SIGHTINGS]
        order = np.argsort(-sightings[own], kind="stable")
        most = POINTS_A_STILL if carried else POINTS_A_CAMERA
        chosen |= set(own[order[:most]].tolist())
    return np.array(sorted(chosen), dtype=int)


def agreeing(result: Adjustment, problem: Problem) -> np.ndarray:
    """Sightings that agree, of points that are still seen often enough, bool (n_views,)."""
    views = problem.views
    error = np.linalg.norm(result.residuals_px[:, 0], axis=-1)
    keep = error <= MATCH_SIGMAS * result.sigma_px[views.camera]
    sightings = np.bincount(views.piece[keep], minlength=len(result.scene.T_base_boards))
    return keep & (sightings[views.piece] >= LEAST_SIGHTINGS)
