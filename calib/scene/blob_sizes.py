"""Blobs of features: how well their middles are known by size, and which a slanted view moves."""

from __future__ import annotations

import numpy as np

from freeswing.calib.camera.lens_models import Array
from freeswing.calib.scene.chosen_points import POINTS_A_STILL

# A blob's middle errs in proportion to its size; noise of pixels bounds that of the smallest.
LEAST_SIZE_PX = 1.0
# The picture of a blob's middle is not the middle of its picture where it is seen obliquely: they
# are apart by size^2 / f times the slope, all to one side. A room of 4 m: blobs above the median
# moved focal lengths by 0.5 to 0.9 %, six deviations, those below this limit by one or two.
OBLIQUE_BLOB_PX = 0.012


def feature_variance(size_px: Array) -> Array:
    """Variance of features by the size of their blobs, up to a common factor, (m,).

    Source:
        Lowe 2004, Distinctive Image Features from Scale-Invariant Keypoints: places are as
        good as their scale; a sum of independent variances.
    """
    return LEAST_SIZE_PX**2 + size_px**2


def small_blobs(image: np.ndarray, size_px: Array, focal_px: Array) -> np.ndarray:
    """Sightings of blobs so small that a slanted view does not move their middles, bool (m,).

    Of an image that has few of them its smallest count.

    Args:
        image: image of each sighting, (m,).
        size_px: size of the blob in each, (m,).
        focal_px: focal length of each image, (n,).

    Source:
        Heikkila 2000, Geometric camera calibration using circular control points, sec. 3.3.
    """
    apart = size_px**2 / focal_px[image]
    small = apart < OBLIQUE_BLOB_PX
    for index in np.unique(image):
        own = np.flatnonzero(image == index)
        if small[own].sum() < POINTS_A_STILL:
            small[own[np.argsort(apart[own], kind="stable")[:POINTS_A_STILL]]] = True
    return small
