"""A session's recorded swings, loaded as what identification works on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.cdpr.files.robot_file import read_robot
from freeswing.cdpr.files.trajectory_files import read_trajectory
from freeswing.cdpr.measured.held_doubled_wild import check_stamps, sound_samples
from freeswing.cdpr.measured.pose_errors import PoseErrors, read_pose_errors
from freeswing.cdpr.measured.recording_to_base_frame import moved_trajectory
from freeswing.cdpr.measured.target import Target, read_target
from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.model.equations import LARGEST_SWINGING
from freeswing.cdpr.robot import Robot
from freeswing.ident.runs import Payload, SwingRun
from freeswing.results.files import read_document
from freeswing.results.tracking import Tracking
from freeswing.session.marker_runs import MarkerRuns, read_marker_runs
from freeswing.session.session_file import Run, Session


def load_robot(session: Session) -> Robot:
    """The session's robot.

    Raises:
        InputError: also where so many cables hold it that nothing can swing.
    """
    robot = read_robot(session.robot)
    if robot.n_cables > LARGEST_SWINGING:
        raise InputError(
            f"{session.robot}: {robot.n_cables} locked cables leave the platform no free motion "
            f"(6 - n coordinates are free): sessions of free swings take up to {LARGEST_SWINGING} "
            "cables; lock fewer, the others off, or record a driven robot (freeswing drive)"
        )
    return robot


def load_target(session: Session) -> Target | None:
    """What is on the platform, None where the session names no target."""
    return None if session.target is None else read_target(session.target)


def trajectory_path(session: Session, run: Run) -> Path:
    """The file of a run's trajectory: measured, or written by tracking."""
    return run.trajectory or session.tracks / f"{run.name}.csv"


def load_swings(
    session: Session, robot: Robot, target: Target | None, markers: MarkerRuns | None = None
) -> tuple[SwingRun, ...]:
    """All runs of a session with their trajectories.

    Args:
        session: whose runs.
        robot: its robot.
        target: what is on the platform.
        markers: its marker recordings where they have been read.

    Raises:
        InputError: naming the run whose file is wrong, or a number of cable lengths that is not
            the robot's.
        DataError: where a video has not been tracked yet.
    """
    errors = calibration_errors(session)
    markers = read_marker_runs(session, target) if markers is None else markers
    swings = (load_swing(session, run, robot, target, markers) for run in session.runs)
    errors |= markers.errors()
    return tuple(replace(swing, pose_errors=errors.get(swing.name)) for swing in swings)


def measured_swings(session: Session, swings: Sequence[SwingRun]) -> tuple[SwingRun, ...]:
    """Those that were recorded by something else than the session's cameras."""
    filmed = {run.name for run in session.video_runs}
    return tuple(swing for swing in swings if swing.name not in filmed)


def calibration_errors(session: Session) -> dict[str, PoseErrors]:
    """What the cameras' calibration may do to the poses of each tracked run, from tracking.json.

    Raises:
        InputError: when that file is not what tracking writes.
    """
    filmed = {run.name for run in session.video_runs}
    told = read_document(session.results / "tracking.json", Tracking) if filmed else None
    return {
        run.run: read_pose_errors(run.calibration_errors)
        for run in (() if told is None else told.runs)
        if run.run in filmed and run.calibration_errors is not None
    }


def load_swing(
    session: Session, run: Run, robot: Robot, target: Target | None, markers: MarkerRuns
) -> SwingRun:
    """One run with its trajectory; see `load_swings`."""
    lengths = run.cable_lengths_m
    if lengths is not None and len(lengths) != robot.n_cables:
        raise InputError(
            f"{session.path}: run {run.name}: cable_lengths_m has {len(lengths)} numbers, "
            f"the robot has {robot.n_cables} cables"
        )
    first = run.payloads[0] if run.payloads else None
    payload = first and Payload(first.mass_kg, first.position_m)
    return SwingRun(
        name=run.name,
        role="identify" if run.role == "identify" else "validate",
        trajectory=load_trajectory(session, run, robot, target, markers),
        lengths_m=lengths,
        lengths_std_m=run.cable_lengths_std_m,
        window_s=run.window_s,
        payload=payload,
    )


def _in_base(session: Session, run: Run, trajectory: Trajectory) -> Trajectory:
    """A measured trajectory turned from the frame of the recordings, where the session names it."""
    if session.T_base_recorded is None or run.trajectory is None:
        return trajectory
    try:
        return moved_trajectory(trajectory, session.T_base_recorded)
    except InputError as failure:
        raise InputError(f"{session.path}: mocap: run {run.name}: {failure}") from failure


def load_trajectory(
    session: Session, run: Run, robot: Robot, target: Target | None, markers: MarkerRuns
) -> Trajectory:
    """A run's measured or tracked motion."""
    path = trajectory_path(session, run)
    if run.trajectory is None and not path.is_file():
        raise DataError(
            f"run {run.name}: its video has not been tracked yet; run freeswing track first"
        )
    trajectory = markers.trajectory(run.name)
    if trajectory is None:
        trajectory = read_trajectory(path, robot, target)
        trajectory = _in_base(session, run, trajectory)
    if run.trajectory is not None:
        check_stamps(trajectory, path.name)
        trajectory = sound_samples(trajectory)
    return replace(trajectory, provenance=trajectory.provenance or path.name)
