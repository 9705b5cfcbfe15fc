"""What the platform's motion is from one marker recording."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.markers.session_markers import fit_session
from freeswing.cdpr.measured.marker_recording import MarkerRecording, marker_position
from freeswing.cdpr.measured.rigid_fit import FEWEST_POINTS, is_planar_or_better
from freeswing.cdpr.measured.target import Marker, Target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import Robot


def known_markers(recording: MarkerRecording, target: Target | None) -> tuple[Marker, ...]:
    """The target's markers that the recording names."""
    markers = target.markers if target else ()
    return tuple(marker for marker in markers if recording.column(marker.name) is not None)


def fixes_poses(recording: MarkerRecording, target: Target) -> bool:
    """Whether three of the target's markers, not on a line, are in the recording."""
    places = [marker.position_m for marker in known_markers(recording, target)]
    return is_planar_or_better(np.array(places))


def trajectory_from_markers(
    recording: MarkerRecording, robot: Robot | None = None, target: Target | None = None
) -> Trajectory:
    """Poses where three markers or more fix them, else the reference point's free coordinates.

    Raises:
        InputError: when the recording's markers tell neither.
        DataError: when no sample shows enough of them.
    """
    if target is not None and fixes_poses(recording, target):
        return fit_session(target, [recording])[1][0].trajectory
    free = robot.free_coordinates if robot else None
    coordinates = ("x", "y", "z") if free is None else free
    angles = [name for name in coordinates if name not in ("x", "y", "z")]
    if angles or not coordinates:
        n_known = len(known_markers(recording, target))
        raise InputError(
            f"{recording.source}: holds {n_known} of the target's markers "
            f"({', '.join(recording.names)[:200]}); a pose needs {FEWEST_POINTS} that are not on a "
            "line: label them as in the target file"
        )
    columns = ["xyz".index(name) for name in coordinates]
    values = marker_position(recording, target)[:, columns]
    provenance = f"{recording.source}: reference marker alone"
    return Trajectory(recording.times_s, coordinates, values, None, provenance)
