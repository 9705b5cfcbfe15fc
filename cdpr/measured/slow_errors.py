"""Errors of a run's poses that averaging over its samples does not remove.

A marker whose centroid is partly hidden drifts slowly, and one that was touched sits elsewhere for
the whole run: the poses of all samples then err together. Whoever weighs samples as if each erred
by itself is too sure by the square root of their number.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.robot import frozen_array

Array = NDArray[np.float64]

# Who knows a run's frame beforehand, where that is what its poses state and no common tolerance.
STATED_BY_RUN = "what each run's poses state"
BESIDE_STATED = "what each run's poses state, and what frames differ by beside it"


@dataclass(frozen=True, slots=True)
class SlowErrors:
    """How far a run's poses err together.

    Both covariances are of d = (small shift in m, small rotation vector in rad) in the platform
    frame: R_true = R exp(d_rotation), p_true = p + R d_shift.

    Attributes:
        frame_covariance: of the constant error of the platform frame in this run, which is no part
            of the trajectory's covariances: the prior of a nuisance of the run, (6, 6).
        drift_covariance: of the part that changes slowly, which the trajectory's covariances hold
            beside the white part, (6, 6).
        correlation_s: time after which the drift's autocorrelation has fallen to 1/e; 0: no drift.
    """

    frame_covariance: Array
    drift_covariance: Array
    correlation_s: float = 0.0

    def __post_init__(self) -> None:
        for name in ("frame_covariance", "drift_covariance"):
            value = np.asarray(getattr(self, name), dtype=np.float64)
            object.__setattr__(self, name, frozen_array(value, (6, 6), f"slow errors: {name}"))
        if not (np.isfinite(self.correlation_s) and self.correlation_s >= 0.0):
            raise ValueError(f"slow errors: correlation_s is {self.correlation_s}, must be >= 0")
