"""One door to trajectory files: .csv, .tum, .trc and .c3d by suffix."""

from __future__ import annotations

from pathlib import Path

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.mocap.text_exports import (
    is_mocap_text,
    read_mocap_text,
    read_motive_body,
)
from freeswing.cdpr.files.trajectory_c3d import read_c3d, write_c3d
from freeswing.cdpr.files.trajectory_csv import read_csv, write_csv
from freeswing.cdpr.files.trajectory_trc import read_trc, write_trc
from freeswing.cdpr.files.trajectory_tum import read_tum, write_tum
from freeswing.cdpr.markers.from_recording import trajectory_from_markers
from freeswing.cdpr.measured.marker_recording import MarkerRecording
from freeswing.cdpr.measured.target import Target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import Robot

__all__ = [
    "holds_markers",
    "read_recording",
    "read_trajectory",
    "write_c3d",
    "write_csv",
    "write_trc",
    "write_tum",
]

SUFFIXES = (".csv", ".tsv", ".trc", ".c3d", ".tum")


def read_trajectory(
    path: Path | str, robot: Robot | None = None, target: Target | None = None
) -> Trajectory:
    """Read a measured motion.

    Poses come back whole, whatever the robot's free coordinates are; a file without poses must
    hold the free coordinates. Markers (.trc, .c3d) become poses by a rigid fit with covariance
    where three of the target's are there, else the reference point's free coordinates.

    Raises:
        InputError: naming the file, the line and what to do.
        DataError: when no sample shows three markers.
    """
    suffix = _suffix(path)
    if suffix == ".csv" and is_mocap_text(path):
        body = read_motive_body(path)
        if body is not None:
            return body
    elif suffix == ".csv":
        return read_csv(path, robot.free_coordinates if robot else None)
    if suffix == ".tum":
        return read_tum(path)
    return trajectory_from_markers(read_recording(path), robot, target)


def read_recording(path: Path | str) -> MarkerRecording:
    """Read the labelled markers of a .trc or .c3d file, or of Motive, Vicon or Qualisys text.

    Raises:
        InputError: naming the file and what to do.
    """
    readers = {".trc": read_trc, ".c3d": read_c3d}
    suffix = _suffix(path)
    if suffix in readers:
        return readers[suffix](path)
    if is_mocap_text(path):
        return read_mocap_text(path)
    raise InputError(
        f"{path}: holds no markers; name a .trc or .c3d file, or an export of Motive, Vicon or QTM"
    )


def holds_markers(path: Path | str) -> bool:
    """Whether a file holds markers, by its ending, or by its first lines where it is text."""
    suffix = Path(path).suffix.lower()
    if suffix in (".csv", ".tsv") and is_mocap_text(path):
        return suffix == ".tsv" or read_motive_body(path) is None
    return suffix in (".trc", ".c3d")


def _suffix(path: Path | str) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"{path}: a trajectory is one of {', '.join(SUFFIXES)}")
    return suffix
