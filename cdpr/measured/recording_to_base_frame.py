"""Recordings made in another frame than the robot's base: axes turned, or a frame of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.measured.marker_recording import MarkerRecording
from freeswing.cdpr.measured.rigid_fit import fit_rigid, is_planar_or_better
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.rotation import transform

Array = NDArray[np.float64]

# R_base_recorded by the recorded axis that points up; the next axis in order stays or follows it.
UP_TURNS = {
    "x": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "z": np.eye(3),
    "-x": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
    "-y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
    "-z": np.diag([1.0, -1.0, -1.0]),
}
# Points surveyed by tape fit to some mm; more is a mistaken point, axis or unit.
MOST_MISFIT_M = 0.02


def frame_from_points(recorded_m: Array, base_m: Array) -> Array:
    """T_base_recorded (4, 4) from points measured in both frames, (n, 3) each.

    Raises:
        InputError: for fewer than three points, points on a line, or points that do not fit.

    Source:
        Kabsch 1976, A solution for the best rotation to relate two sets of vectors.
    """
    if not (is_planar_or_better(recorded_m) and is_planar_or_better(base_m)):
        raise InputError(f"{len(base_m)} points; three or more that are not on a line are needed")
    R, t = fit_rigid(recorded_m, base_m[None])
    off = np.linalg.norm(recorded_m @ R[0].T + t[0] - base_m, axis=1)
    if off.max() > MOST_MISFIT_M:
        k = int(off.argmax())
        raise InputError(
            f"point {k + 1} is {1e3 * off[k]:.0f} mm from where the others put it, more than "
            f"{1e3 * MOST_MISFIT_M:.0f} mm: check its numbers, the order and the unit (m)"
        )
    return transform(R[0], t[0])


def moved_recording(recording: MarkerRecording, T_base_recorded: Array) -> MarkerRecording:
    """The markers in the base frame."""
    points = recording.positions_m @ T_base_recorded[:3, :3].T + T_base_recorded[:3, 3]
    return replace(recording, positions_m=points)


def moved_trajectory(trajectory: Trajectory, T_base_recorded: Array) -> Trajectory:
    """The poses in the base frame, with their covariances.

    Raises:
        InputError: where the trajectory holds no full poses.
    """
    if not trajectory.is_pose:
        held = ", ".join(trajectory.coordinates)
        raise InputError(f"holds {held} alone; only full poses and markers can be turned")
    R, t = T_base_recorded[:3, :3], T_base_recorded[:3, 3]
    both = np.kron(np.eye(2), R)
    noise = trajectory.covariances
    moved = Trajectory.from_poses(
        trajectory.times_s,
        trajectory.positions() @ R.T + t,
        R @ trajectory.rotations(),
        None if noise is None else both @ noise @ both.T,
        trajectory.provenance,
        trajectory.slow,
    )
    return replace(moved, notes=trajectory.notes)
