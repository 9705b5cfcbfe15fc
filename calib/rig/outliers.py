"""Views and corners of a rig that lie too far off to belong: dropped and named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from freeswing.calib.camera.lens_models import Array
from freeswing.calib.rig.bundle_adjustment import (
    MEDIAN_OF_RAYLEIGH,
    Adjustment,
)
from freeswing.calib.rig.normal_equations import Problem, length_with_share
from freeswing.calib.rig.reprojection import Scene
from freeswing.calib.rig.views import Views

# Of its camera's usual error: a moved or misread board leaves more.
VIEW_OUTLIER_SIGMAS = 5.0
VIEW_OUTLIER_FLOOR_PX = 0.5  # below half a pixel nothing was misread, whatever the others reach
CORNER_SIGMAS = 6.0  # one in 1e8 by chance: none of a session's 1e5 corners
# share of normal errors within the limit of a corner's on its own, as large for corners together
CORNER_WITHIN = 1.0 - np.exp(-0.5 * CORNER_SIGMAS**2)
LEAST_CORNERS = 4  # three leave four poses of the board open


def views_kept(result: Adjustment, problem: Problem) -> tuple[np.ndarray, Array, Array]:
    """Views whose error stays near what is usual in their camera; limits and errors, px.

    The error is the median corner's, each axis: one bad corner is trimmed, not the whole view.

    Source:
        Rousseeuw, Leroy 1987, Robust Regression and Outlier Detection, ch. 5: median scale.
    """
    lengths = np.linalg.norm(result.residuals_px, axis=-1)
    errors = np.nanmedian(lengths, axis=1) / MEDIAN_OF_RAYLEIGH
    limits = np.zeros(len(errors))
    for index in range(len(result.scene.cameras)):
        own = problem.views.camera == index
        if own.any():
            usual = max(float(np.median(errors[own])), float(result.sigma_px[index]))
            limits[own] = max(VIEW_OUTLIER_SIGMAS * usual, VIEW_OUTLIER_FLOOR_PX)
    return errors <= limits, limits, errors


def determined_pieces(views: Views, scene: Scene) -> np.ndarray:
    """Whether a piece still has as many moments as its motion has coefficients, (n_pieces,)."""
    pairs = np.unique(np.stack([views.piece, views.moment]), axis=1)
    moments = np.bincount(pairs[0], minlength=len(scene.motion))
    rests = np.bincount(views.piece, np.isnan(views.lag_s), len(scene.motion)) > 0
    return moments > np.where(rests, 0, scene.motion.shape[1])


def without_far_corners(result: Adjustment, problem: Problem) -> Views:
    """The views with far-off corners blanked, all that were found together."""
    views = problem.views
    white = views.whitened(result.residuals_px)
    limit = length_with_share(CORNER_WITHIN, white.shape[-1]) * result.sigma_px[views.camera]
    with np.errstate(invalid="ignore"):
        far = np.linalg.norm(white, axis=-1) > limit[:, None]
    far = np.repeat(far, views.group_size, axis=1)
    return replace(views, pixels=np.where(far[..., None], np.nan, views.pixels))
