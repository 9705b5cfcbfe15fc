"""Labelled markers over time, and what the platform's motion is from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.measured.target import Target
from freeswing.cdpr.measured.trajectory import Trajectory

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
        notes: what the reader took for what, one sentence each.
    """

    times_s: Array
    names: tuple[str, ...]
    positions_m: Array
    source: str = "recording"
    notes: tuple[str, ...] = ()

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

    @property
    def step_s(self) -> float:
        """Median time between samples."""
        return float(np.median(np.diff(self.times_s))) if len(self.times_s) > 1 else 0.0

    def column(self, name: str) -> int | None:
        """Index of a marker, also where the file writes `subject:name` or capitals; None if absent.

        Of several that match alike none is taken.
        """
        plain = [label.rpartition(":")[2] for label in self.names]
        folded = [label.casefold() for label in plain]
        for labels, wanted in ((self.names, name), (plain, name), (folded, name.casefold())):
            if wanted in labels:
                return labels.index(wanted) if list(labels).count(wanted) == 1 else None
        return None

    def select(self, names: tuple[str, ...]) -> MarkerRecording:
        """The named markers, NaN throughout for those that the recording does not hold."""
        positions = np.full((len(self.times_s), len(names), 3), np.nan)
        for i, name in enumerate(names):
            column = self.column(name)
            if column is not None:
                positions[:, i] = self.positions_m[:, column]
        return MarkerRecording(self.times_s, names, positions, self.source, self.notes)


def recording_from_poses(trajectory: Trajectory, target: Target) -> MarkerRecording:
    """Where the target's markers are along a pose trajectory."""
    moved = np.einsum("tij,mj->tmi", trajectory.rotations(), target.marker_positions_m)
    positions = moved + trajectory.positions()[:, None, :]
    source = trajectory.provenance or "trajectory"
    return MarkerRecording(trajectory.times_s, target.marker_names, positions, source)


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
