"""Labelled markers over time, and what the platform's motion is from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.measured.rigid_fit import (
    FEWEST_POINTS,
    MarkerFit,
    fit_markers,
    is_planar_or_better,
)
from freeswing.cdpr.measured.target import Target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import Robot

Array = NDArray[np.float64]

REFERENCE_MARKER = "P"
AT_REFERENCE_M = 1e-9


@dataclass(frozen=True, slots=True)
class MarkerRecording:
    """Marker positions in the base frame.

    Attributes:
        times_s: (n_t,), increasing.
        names: labels, n_m of them, all different.
        positions_m: base frame, NaN where a marker is not seen, (n_t, n_m, 3).
        source: the file's name, for messages.
    """

    times_s: Array
    names: tuple[str, ...]
    positions_m: Array
    source: str = "recording"

    def __post_init__(self) -> None:
        times, positions = (np.array(a, dtype=np.float64) for a in (self.times_s, self.positions_m))
        times.flags.writeable = positions.flags.writeable = False
        object.__setattr__(self, "times_s", times)
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "positions_m", positions)
        shape = (len(times), len(self.names), 3)
        if positions.shape != shape:
            raise ValueError(f"positions_m: shape {positions.shape}, expected {shape}")
        if len(set(self.names)) < len(self.names):
            raise ValueError(f"names: {self.names} are not all different")

    def column(self, name: str) -> int | None:
        """Index of a marker, also where the file writes `subject:name`; None when absent."""
        if name in self.names:
            return self.names.index(name)
        ends = [i for i, label in enumerate(self.names) if label.rpartition(":")[2] == name]
        return ends[0] if len(ends) == 1 else None

    def select(self, names: tuple[str, ...]) -> MarkerRecording:
        """The named markers, NaN throughout for those that the recording does not hold."""
        positions = np.full((len(self.times_s), len(names), 3), np.nan)
        for i, name in enumerate(names):
            column = self.column(name)
            if column is not None:
                positions[:, i] = self.positions_m[:, column]
        return MarkerRecording(self.times_s, names, positions, self.source)


def recording_from_poses(trajectory: Trajectory, target: Target) -> MarkerRecording:
    """Where the target's markers are along a pose trajectory."""
    moved = np.einsum("tij,mj->tmi", trajectory.rotations(), target.marker_positions_m)
    positions = moved + trajectory.positions()[:, None, :]
    source = trajectory.provenance or "trajectory"
    return MarkerRecording(trajectory.times_s, target.marker_names, positions, source)


def fit_recording(recording: MarkerRecording, target: Target) -> MarkerFit:
    """Poses by rigid fit of the target's markers; see `cdpr.measured.rigid_fit.fit_markers`."""
    chosen = recording.select(target.marker_names)
    return fit_markers(target.marker_positions_m, chosen.positions_m)


def marker_position(recording: MarkerRecording, target: Target | None = None) -> Array:
    """Positions of the reference point P from its own marker, (n_t, 3), NaN where not seen.

    Its marker is the target's one at the platform's origin, or else the one named `P`.

    Raises:
        InputError: when the recording holds no such marker.
    """
    name = REFERENCE_MARKER
    for marker in target.markers if target else ():
        if np.linalg.norm(marker.position_m) < AT_REFERENCE_M:
            name = marker.name
    column = recording.column(name)
    if column is None:
        raise InputError(
            f"{recording.source}: no marker {name!r} at the reference point among "
            f"{', '.join(recording.names)[:200]}; rename it, or list three or more of the markers "
            "in the target file"
        )
    return recording.positions_m[:, column]


def trajectory_from_markers(
    recording: MarkerRecording, robot: Robot | None = None, target: Target | None = None
) -> Trajectory:
    """Poses where three markers or more fix them, else the reference point's free coordinates.

    Raises:
        InputError: when the recording's markers tell neither.
        DataError: when no sample shows enough of them.
    """
    known = [m for m in target.markers if recording.column(m.name) is not None] if target else []
    if is_planar_or_better(np.array([m.position_m for m in known])):
        return _poses(recording, Target(markers=tuple(known)))
    free = robot.free_coordinates if robot else None
    coordinates = ("x", "y", "z") if free is None else free
    angles = [name for name in coordinates if name not in ("x", "y", "z")]
    if angles or not coordinates:
        raise InputError(
            f"{recording.source}: holds {len(known)} of the target's markers "
            f"({', '.join(recording.names)[:200]}); a pose needs {FEWEST_POINTS} that are not on a "
            "line: label them as in the target file"
        )
    columns = ["xyz".index(name) for name in coordinates]
    values = marker_position(recording, target)[:, columns]
    provenance = f"{recording.source}: reference marker alone"
    return Trajectory(recording.times_s, coordinates, values, None, provenance)


def _poses(recording: MarkerRecording, target: Target) -> Trajectory:
    fit = fit_recording(recording, target)
    change = float(np.linalg.norm(fit.layout_change_m, axis=1).max())
    provenance = (
        f"{recording.source}: rigid fit of {len(target.markers)} markers, "
        f"noise {1e3 * fit.noise_std_m:.3g} mm, layout changed by up to {1e3 * change:.3g} mm"
    )
    covariances = fit.covariances if fit.noise_std_m > 0.0 else None
    return Trajectory.from_poses(
        recording.times_s, fit.positions_m, fit.rotations, covariances, provenance
    )
