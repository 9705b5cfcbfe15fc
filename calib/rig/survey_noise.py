"""How far surveyed points are off, by what the cameras ask of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.rig.bundle_adjustment import (
    Adjustment,
)
from freeswing.calib.rig.views import FixedPoints

_SURVEY_PRIOR = 2.0  # corrections that the stated value counts for: a few others hardly move it
LEAST_SURVEY_STD_M = 2e-5  # of a coordinate: no survey is known better


def survey_std(result: Adjustment, fixed: FixedPoints, of: NDArray[np.bool_]) -> float:
    """Standard deviation of a surveyed coordinate from the corrections the cameras ask for.

    Variance component estimation: squared corrections over the redundancy that carries them
    (Foerstner and Wrobel 2016, sec. 4.2.4). Few corrections leave the given value nearly alone:
    it counts as `_SURVEY_PRIOR` corrections of its own. Points `of` (n,) take part.
    """
    correction = (result.scene.base_points_m - fixed.points_base_m)[of]
    given = float(fixed.std_m[of].mean())
    variance = np.diag(result.covariance)[-fixed.points_base_m.size :]
    left = variance.reshape(-1, 3)[of].ravel() / given**2
    redundancy = max(float(correction.size - left.sum()), 0.0)
    total = float(np.sum(correction**2)) + _SURVEY_PRIOR * given**2
    return max(np.sqrt(total / (redundancy + _SURVEY_PRIOR)), LEAST_SURVEY_STD_M)
