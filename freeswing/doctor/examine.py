"""A session examined from its files to its swings; every subject is looked at, whatever fails."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from typing import TypeVar

from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.cdpr.measured.target import Target
from freeswing.cdpr.robot import Robot
from freeswing.cdpr.system.progress import Progress
from freeswing.doctor.bench_runs import bench_findings
from freeswing.doctor.finding import Finding
from freeswing.doctor.footage import (
    calibration_findings,
    footage_findings,
    video_findings,
)
from freeswing.doctor.markers import marker_findings
from freeswing.doctor.robot_file.mass_and_inertia import mass_findings, payload_findings
from freeswing.doctor.robot_file.mistaken_cables import mistaken_cables
from freeswing.doctor.robot_file.units_and_places import robot_findings
from freeswing.doctor.run_roles import split_findings
from freeswing.doctor.run_samples import run_findings
from freeswing.ident.runs import SwingRun
from freeswing.session.load_bench import is_bench
from freeswing.session.load_swings import load_robot, load_swing, load_target, trajectory_path
from freeswing.session.marker_runs import MarkerRuns, read_marker_runs
from freeswing.session.session_file import Run, Session

Loaded = TypeVar("Loaded")


def examine(session: Session, progress: Progress | None = None) -> tuple[Finding, ...]:
    """All findings, errors first."""
    found = list(_findings(session, progress or (lambda _label, _fraction: None)))
    order = ("error", "warning", "note")
    return tuple(sorted(found, key=lambda finding: order.index(finding.level)))


def _findings(session: Session, progress: Progress) -> Iterator[Finding]:
    robot = yield from _tried("robot", lambda: load_robot(session))
    target = yield from _tried("target", lambda: load_target(session))
    if robot is not None:
        yield from robot_findings(robot)
        yield from mass_findings(robot)
    yield from calibration_findings(session)
    progress("reading the markers", 0.0)
    markers = read_marker_runs(session, target)
    yield from marker_findings(markers)
    swings: list[SwingRun] = []
    bench = robot is not None and is_bench(session, robot)
    for count, run in enumerate(session.runs):
        progress("examining the runs", count / len(session.runs))
        if run.video is not None:
            yield from video_findings(session, run)
            yield from footage_findings(f"run {run.name}", run.video, session.frame_rate_hz)
        if robot is not None and not bench:
            swing = yield from _run(session, run, robot, target, markers)
            swings += [] if swing is None else [swing]
    if robot is not None and bench:
        swings = yield from bench_findings(session, robot, target)
    if robot is not None and not bench:
        yield from payload_findings(session.runs, robot)
        said, remedy = mistaken_cables(swings, robot)
        if said:
            yield Finding("error", "robot", said, remedy)
    yield from split_findings(session, swings, left_out=bench)
    progress("examining the runs", 1.0)


def _run(
    session: Session, run: Run, robot: Robot, target: Target | None, markers: MarkerRuns
) -> Generator[Finding, None, SwingRun | None]:
    if run.video is not None and not trajectory_path(session, run).is_file():
        yield Finding("note", f"run {run.name}", "not tracked yet", "run freeswing track")
        return None
    if markers.layout_failure is not None and run.name in markers.failures:
        return None
    swing = yield from _tried(
        f"run {run.name}", lambda: load_swing(session, run, robot, target, markers)
    )
    if swing is not None:
        yield from run_findings(
            swing, robot, session.frame_rate_hz, measured=run.trajectory is not None
        )
    return swing


def _tried(subject: str, load: Callable[[], Loaded]) -> Generator[Finding, None, Loaded | None]:
    try:
        return load()
    except (InputError, DataError) as failure:
        yield Finding("error", subject, str(failure).replace("\n", " "))
        return None
