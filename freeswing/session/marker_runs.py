"""A session's marker recordings, fitted together: one layout for all runs."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

from freeswing.cdpr.files.problems import DataError, InputError
from freeswing.cdpr.files.trajectory_files import holds_markers, read_recording
from freeswing.cdpr.markers.from_recording import fixes_poses
from freeswing.cdpr.markers.layout_of_session import SessionLayout
from freeswing.cdpr.markers.session_markers import (
    Examined,
    RunMarkers,
    common_layout,
    examine,
    place,
)
from freeswing.cdpr.measured.pose_errors import PoseErrors
from freeswing.cdpr.measured.recording_to_base_frame import moved_recording
from freeswing.cdpr.measured.target import Target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.system.threads import side_by_side
from freeswing.session.session_file import Run, Session

Failure = InputError | DataError


@dataclass(frozen=True, slots=True)
class MarkerRuns:
    """What the markers of each run gave, or why they gave nothing.

    Attributes:
        target: whose markers they are, None: the session has no marker recordings.
        layout: the session's, None where there is none.
        runs: by name.
        failures: by name.
        layout_failure: why there is no layout for any of them.
    """

    target: Target | None = None
    layout: SessionLayout | None = None
    runs: dict[str, RunMarkers] = field(default_factory=dict)
    failures: dict[str, Failure] = field(default_factory=dict)
    layout_failure: DataError | None = None

    def trajectory(self, name: str) -> Trajectory | None:
        """A run's poses, None where its recording holds no marker poses.

        Raises:
            InputError, DataError: why it has none.
        """
        if name in self.failures:
            raise self.failures[name]
        return self.runs[name].trajectory if name in self.runs else None

    def errors(self) -> dict[str, PoseErrors]:
        """What the poses of all runs have wrong together, by run."""
        found = ((name, run.errors) for name, run in self.runs.items())
        return {name: errors for name, errors in found if errors is not None}


def read_marker_runs(session: Session, target: Target | None) -> MarkerRuns:
    """Read and fit every run that has a marker recording; nothing is raised here.

    The layout is that of the identify runs alone, so that held-out runs stay held out.
    """
    if target is None or not target.markers:
        return MarkerRuns()
    read = side_by_side(partial(_read, session, target), session.runs)
    named = {run.name: one for run, one in zip(session.runs, read, strict=True)}
    examined = {name: one for name, one in named.items() if isinstance(one, Examined)}
    failures = {name: one for name, one in named.items() if isinstance(one, Failure)}
    if not examined:
        return MarkerRuns(failures=failures)
    fitted = [run.name for run in session.runs if run.role == "identify" and run.name in examined]
    try:
        layout = common_layout(target, [examined[name] for name in fitted or examined])
    except DataError as failure:
        return MarkerRuns(target, None, {}, failures | dict.fromkeys(examined, failure), failure)
    placed = zip(examined, side_by_side(partial(_placed, layout), examined.values()), strict=True)
    runs: dict[str, RunMarkers] = {}
    for name, one in placed:
        if isinstance(one, DataError):
            failures[name] = one
        else:
            runs[name] = one
    return MarkerRuns(target, layout, runs, failures)


def _read(session: Session, target: Target, run: Run) -> Examined | Failure | None:
    """A run's markers, why they are not to be had, or None where it has none."""
    try:
        if run.trajectory is None or not holds_markers(run.trajectory):
            return None
        recording = read_recording(run.trajectory)
        if session.T_base_recorded is not None:
            recording = moved_recording(recording, session.T_base_recorded)
        if fixes_poses(recording, target):
            return examine(recording, target, run.window_s)
    except (InputError, DataError) as failure:
        return failure
    return None


def _placed(layout: SessionLayout, found: Examined) -> RunMarkers | DataError:
    try:
        return place(found, layout)
    except DataError as failure:
        return failure
