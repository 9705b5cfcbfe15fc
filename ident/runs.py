"""What identification works on: recorded swings with their roles, lengths and payloads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.measured.pose_errors import PoseErrors
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import Array, frozen_array

Role = Literal["identify", "validate"]


@dataclass(frozen=True, slots=True)
class Payload:
    """A known mass added to the platform for a run.

    Attributes:
        mass_kg: added mass, > 0.
        position_m: its centre of mass in the platform frame, (3,).
    """

    mass_kg: float
    position_m: Array

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mass_kg) and self.mass_kg > 0.0):
            raise ValueError(f"payload: mass_kg is {self.mass_kg}, must be > 0")
        position = frozen_array(self.position_m, (3,), "payload: position_m")
        object.__setattr__(self, "position_m", position)


@dataclass(frozen=True, slots=True)
class SwingRun:
    """One recorded swing.

    Attributes:
        name: the run's label, used in every message about it.
        role: `identify`, or `validate`: never used for fitting.
        trajectory: full poses, or the free coordinates alone.
        lengths_m: cable lengths held during the run, (n,), or None: taken from the poses.
        lengths_std_m: their standard deviation, one for all cables, or None: unknown.
        window_s: start and end of the free motion, or None: found from the samples.
        payload: a known mass added for this run, or None.
        pose_errors: what the calibration may do to all its poses, or None: unknown.
    """

    name: str
    role: Role
    trajectory: Trajectory
    lengths_m: Array | None = None
    lengths_std_m: float | None = None
    window_s: tuple[float, float] | None = None
    payload: Payload | None = None
    pose_errors: PoseErrors | None = None

    def __post_init__(self) -> None:
        if self.role not in ("identify", "validate"):
            raise ValueError(f"run {self.name}: role is {self.role!r}, not identify or validate")
        if self.lengths_m is not None:
            lengths = np.asarray(self.lengths_m, dtype=np.float64)
            object.__setattr__(
                self, "lengths_m", frozen_array(lengths, lengths.shape, f"run {self.name}: lengths")
            )
        if self.window_s is not None and not self.window_s[0] < self.window_s[1]:
            raise ValueError(
                f"run {self.name}: window_s is {list(self.window_s)}, its end must follow its start"
            )

    def inside(self) -> Trajectory:
        """Samples inside the window; all where none is given.

        Raises:
            DataError: when it holds none.
        """
        return self.trajectory.window(*self.window_s) if self.window_s else self.trajectory

    def known_poses(self) -> Trajectory | None:
        """Those of them that are known full poses; None where there are none."""
        try:
            part = self.inside()
        except DataError:  # an empty window is said where the run is prepared
            return None
        return part.take(part.is_known) if part.is_pose and part.is_known.any() else None


@dataclass(frozen=True, slots=True)
class DroppedRun:
    """A run that was left out.

    Attributes:
        run: its name.
        why: with the number that says so.
        lawless: whether it is because no free swing explains it.
    """

    run: str
    why: str
    lawless: bool = False
