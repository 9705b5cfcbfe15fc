"""A driven session as it is identified: what was recorded, and what is asked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.driven.model import DrivenModel
from freeswing.ident.drive.kinematics import (
    StaticPoses,
)
from freeswing.ident.drive.run_problem import (
    DriveRun,
    Noise,
)
from freeswing.ident.drive.unknowns import Asked

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class DriveSession:
    """What was recorded, and what is asked.

    Attributes:
        model: the declared robot.
        asked: the unknowns.
        runs: all recordings.
        static: poses at rest, or None.
        noise: of the readings.
        zero_pose: where all angles are zero, or None.
    """

    model: DrivenModel
    asked: Asked
    runs: tuple[DriveRun, ...]
    static: StaticPoses | None
    noise: Noise
    zero_pose: Array | None

    def of(self, role: str) -> tuple[DriveRun, ...]:
        """The runs of a role."""
        return tuple(run for run in self.runs if run.role == role)
