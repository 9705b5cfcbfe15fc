"""A session's runs as those of a bench, where it is one."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np

from freeswing.cdpr.files.documents import InputError
from freeswing.cdpr.files.signal_csv import coordinates_in, header_of, read_signals
from freeswing.cdpr.measured.target import Target
from freeswing.cdpr.measured.trajectory import Trajectory, angle_noise
from freeswing.cdpr.robot import POSE_COORDINATES, Robot
from freeswing.cdpr.simulation.parallel_wires import hangs_parallel
from freeswing.ident.bench.runs import Bench, BenchRun, Signal
from freeswing.ident.runs import SwingRun
from freeswing.results.files import read_document
from freeswing.results.tracking import Tracking
from freeswing.session.load_swings import load_trajectory, trajectory_path
from freeswing.session.marker_runs import read_marker_runs
from freeswing.session.session_file import Run, Session
from freeswing.vision.planar.axes_at_rest import check_hangs_straight


def is_bench(session: Session, robot: Robot) -> bool:
    """Whether a session is one of a bench: what only the joint fit of all its runs can use.

    Channels, loads, payloads with extent, runs that measure less than the free coordinates, or
    parallel wires, on which no swing tells all nine inertial parameters.
    """
    if session.channels or session.loads:
        return True
    if any(len(run.payloads) > 1 or run.loads for run in session.runs):
        return True
    if any(body.inertia_kg_m2.any() for run in session.runs for body in run.payloads):
        return True
    return hangs_parallel(robot) or any(_is_partial(run, robot) for run in session.runs)


def _is_partial(run: Run, robot: Robot) -> bool:
    path = run.trajectory
    if path is None or path.suffix.lower() != ".csv":
        return False
    try:
        measured = coordinates_in(header_of(path))
    except InputError:  # said of the run by whoever reads it
        return False
    return 0 < len(measured) < 6 - robot.n_cables


def load_bench(session: Session, robot: Robot, target: Target | None) -> Bench:
    """All runs with their signals.

    Raises:
        InputError: naming the file that is wrong, a channel whose column no run holds, or a number
            of wire lengths that is not the robot's.
    """
    columns = tuple(channel.column for channel in session.channels)
    places = planar_places(session)
    if places:
        check_hangs_straight(session.robot, robot)
    runs = tuple(
        _load_run(session, run, robot, target, columns, places.get(run.name))
        for run in session.runs
    )
    seen = {signal.column for run in runs for signal in run.signals}
    for channel in session.channels:
        if channel.column not in seen:
            raise InputError(
                f"{session.path}: channels: {channel.name}: column {channel.column!r} is in none "
                f"of the trajectory files, which hold {', '.join(sorted(seen))}"
            )
    return Bench(runs, session.channels, session.loads, _mass_std(session.robot))


def coordinate_swings(bench: Bench) -> list[SwingRun]:
    """Runs that measure coordinates of the pose, as runs of those alone."""
    return [swing for run in bench.runs if (swing := _as_swing(run)) is not None]


def _as_swing(run: BenchRun) -> SwingRun | None:
    """A run's coordinates alone; None where it measures channels only."""
    columns = {signal.column: signal.values for signal in run.signals}
    if not run.coordinates:
        return None
    values = np.stack([columns[name] for name in run.coordinates], axis=1)
    trajectory = Trajectory(
        run.times_s, run.coordinates, values, provenance=run.name, notes=run.notes
    )
    return SwingRun(run.name, run.role, trajectory, run.lengths_m, run.lengths_std_m, run.window_s)


def planar_places(session: Session) -> dict[str, np.ndarray]:
    """Runs filmed by one camera from above, and the point of the platform that they follow."""
    told = (
        read_document(session.results / "tracking.json", Tracking) if session.video_runs else None
    )
    return {
        run.run: np.array(run.planar.place_m)
        for run in (() if told is None else told.runs)
        if run.planar is not None
    }


def _load_run(
    session: Session,
    run: Run,
    robot: Robot,
    target: Target | None,
    columns: tuple[str, ...],
    place_m: np.ndarray | None = None,
) -> BenchRun:
    lengths = run.cable_lengths_m
    if lengths is not None and len(lengths) != robot.n_cables:
        raise InputError(
            f"{session.path}: run {run.name}: cable_lengths_m has {len(lengths)} numbers, "
            f"the robot has {robot.n_cables} cables"
        )
    path = trajectory_path(session, run)
    if path.suffix.lower() == ".csv" and path.is_file():
        table = read_signals(path, columns)
        times, notes = table.times_s, table.notes
        signals = tuple(
            Signal(
                name, values, table.stds.get(name), place_m if name in POSE_COORDINATES else None
            )
            for name, values in table.values.items()
        )
    else:
        trajectory = load_trajectory(session, run, robot, target, read_marker_runs(session, target))
        times, noise, notes = trajectory.times_s, None, trajectory.notes
        if trajectory.covariances is not None:
            turned = angle_noise(trajectory.coordinates, trajectory.values, trajectory.covariances)
            noise = np.sqrt(np.diagonal(turned, axis1=1, axis2=2))
        signals = tuple(
            Signal(name, trajectory.values[:, k], None if noise is None else noise[:, k])
            for k, name in enumerate(trajectory.coordinates)
            if name in POSE_COORDINATES
        )
    return BenchRun(
        name=run.name,
        role="identify" if run.role == "identify" else "validate",
        times_s=times,
        signals=signals,
        lengths_m=lengths,
        lengths_std_m=run.cable_lengths_std_m,
        window_s=run.window_s,
        payloads=run.payloads,
        loads=run.loads,
        level_std_rad=run.level_std_rad,
        notes=notes,
    )


def _mass_std(path: Path) -> float | None:
    """`mass_std_kg` of a robot file, which has been read and found right before."""
    platform = tomllib.loads(path.read_text(encoding="utf-8")).get("platform", {})
    given = platform.get("mass_std_kg")
    return None if given is None else float(given)
