"""Follow the platform through the videos: a trajectory with covariance for each run."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial
from typing import TYPE_CHECKING, Any

from freeswing.commands.arguments import add_session, add_workers, crew_of, open_session
from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.cdpr.measured.target import Target
    from freeswing.results.tracking import Tracking
    from freeswing.session.made import Made
    from freeswing.session.session_file import Session
    from freeswing.vision.settings import Settings
    from freeswing.vision.track_session import Tracked
    from freeswing.workers.crew import Crew


def add_arguments(parser: ArgumentParser) -> None:
    """The session and how to track."""
    add_session(parser)
    add_workers(parser)
    parser.add_argument(
        "--trust-cameras",
        action="store_true",
        help="do not look for late clocks, rolling shutters and moved cameras",
    )
    parser.add_argument(
        "--refine-layout", action="store_true", help="fit the tags' places to the recordings"
    )
    parser.add_argument(
        "--no-tags",
        action="store_true",
        help="follow the platform by what it looks like: [untagged] of target.toml",
    )
    parser.add_argument(
        "--planar",
        action="store_true",
        help="one camera from above, its lens known or not: chi, x, y of tags or dots that lie in "
        "the platform's plane; without target.toml two dots become two channels",
    )
    parser.add_argument(
        "--write-channels",
        action="store_true",
        help="with --planar: put the two dots' [[channels]] into session.toml",
    )
    parser.add_argument(
        "--write-clocks",
        action="store_true",
        help="put the clocks that all runs agree on into cameras.toml",
    )
    parser.add_argument(
        "--view",
        action="store_true",
        help="write results/tracking.rrd for the viewer rerun too (extra: view)",
    )
    parser.add_argument(
        "--overlay",
        action="store_true",
        help="draw what was seen over the frames: results/overlay/RUN/CAMERA.mp4",
    )


def run(options: Namespace, console: Console) -> None:
    """Track, write results/tracks/*.csv and results/tracking.json."""
    from freeswing.session.stages import TRACK

    session = open_session(options)
    if options.view:
        from freeswing.vision.show.rerun_view import require_viewer

        require_viewer()
    settings = {"correct_rig": not options.trust_cameras, "refine_layout": options.refine_layout}
    if options.no_tags:
        settings["no_tags"] = True
        _refuse_drawing(options, "--no-tags")
    if options.planar or session.planar:
        settings["planar"] = True
        _refuse_drawing(options, "--planar")
    with crew_of(options, session) as crew:
        result = TRACK.take(session, console, settings, crew)
    if options.view or options.overlay:
        _draw(session, console, view=options.view, overlay=options.overlay)
    if options.write_clocks:
        _write_clocks(session, console)
    if options.write_channels:
        _write_channels(session, console)
    console.say(str(result))
    console.show_file(result)


def make(session: Session, console: Console, settings: dict[str, Any], crew: Crew) -> Made:
    """tracking.json as a document, and the tracks."""
    from freeswing.calib.camera.cameras_file import read_cameras
    from freeswing.cdpr.files.documents import DataError, InputError
    from freeswing.session.load_swings import load_target
    from freeswing.vision.look.watched_target import Watch
    from freeswing.vision.settings import Settings
    from freeswing.vision.track_session import track_session

    if settings.get("planar") or session.planar:
        return _planar(session, console, crew)
    if not session.cameras.is_file():
        raise DataError(f"{session.cameras}: no such file; {_whence(session)}")
    target = load_target(session)
    if target is None:
        raise InputError(f"{session.path}: target: missing; it says what is on the platform")
    how = Settings(settings["correct_rig"], settings["refine_layout"])
    if settings.get("no_tags") or not (target.tags or target.markers):
        return _made(_by_looks(session, console, how, crew, target), session, console)
    base_tags = session.calibration.base_tags if session.calibration else ()
    found = track_session(
        session.video_runs,
        read_cameras(session.cameras),
        Watch.of(target, base_tags),
        results=session.results,
        frame_rate_hz=session.frame_rate_hz,
        settings=how,
        workers=crew.processes,
        executor=crew.executor,
        progress=console.progress,
    )
    return _made(found, session, console)


def _planar(session: Session, console: Console, crew: Crew) -> Made:
    """One camera from above: x, y, chi, or two channels."""
    from freeswing.calib.camera.cameras_file import read_cameras
    from freeswing.cdpr.files.signal_csv import signal_pieces
    from freeswing.cdpr.files.trajectory_csv import csv_pieces
    from freeswing.results.tracking import Tracking
    from freeswing.session.load_swings import load_target
    from freeswing.session.made import Made
    from freeswing.vision.planar.track_planar import track_planar

    found = track_planar(
        session.video_runs,
        read_cameras(session.cameras) if session.cameras.is_file() else None,
        load_target(session),
        results=session.results,
        frame_rate_hz=session.frame_rate_hz,
        workers=crew.processes,
        executor=crew.executor,
        progress=console.progress,
    )
    document = Tracking.from_json(found.document)
    _summarise_planar(document, console)
    for sentence in found.said:
        console.say(f"  {sentence}")
    named = {channel.column for channel in session.channels}
    if found.channels and not set(next(iter(found.signals.values())).values) <= named:
        console.say(f"\n{found.channels}")
    tracks = [
        *((name, partial(csv_pieces, one)) for name, one in found.trajectories.items()),
        *((name, partial(signal_pieces, one)) for name, one in found.signals.items()),
    ]
    paths = tuple((session.tracks / f"{name}.csv", pieces) for name, pieces in tracks)
    return Made((("tracking.json", document),), paths)


def _summarise_planar(document: Tracking, console: Console) -> None:
    from freeswing.report.words import number

    for run in document.runs:
        noise = ""
        if run.planar is not None:
            noise = f", x, y to {number(run.position_std_mm)} mm, "
            noise += f"chi to {number(run.rotation_std_mrad)} mrad"
        console.say(f"  {run.run}: {run.known} of {run.samples} frames{noise}")
        for problem in run.problems:
            console.say(f"    {problem}")


def _write_channels(session: Session, console: Console) -> None:
    """session.toml with the two dots' channels at its end; tracks made before are then old."""
    from freeswing.cdpr.files.documents import InputError, replace_file
    from freeswing.cdpr.files.signal_csv import header_of
    from freeswing.vision.planar.two_dots import COLUMNS, channel_block

    there = {channel.column for channel in session.channels}
    made = [run for run in session.video_runs if (session.tracks / f"{run.name}.csv").is_file()]
    header = header_of(session.tracks / f"{made[0].name}.csv") if made else ()
    if COLUMNS[0] not in header:
        raise InputError("--write-channels: two dots without target.toml make channels, no tags do")
    if set(COLUMNS) <= there:
        console.say(f"  {session.path}: has these channels already")
        return
    text = session.path.read_text(encoding="utf-8").rstrip("\n")
    replace_file(session.path, f"{text}\n\n{channel_block()}".encode())
    console.say(f"  {session.path}: two [[channels]] added")


def _refuse_drawing(options: Namespace, with_flag: str) -> None:
    from freeswing.cdpr.files.documents import InputError

    flags = {"--view": options.view, "--overlay": options.overlay}
    for flag in (flag for flag, wanted in flags.items() if wanted):
        raise InputError(
            f"{flag} draws tags and markers of calibrated cameras: leave it out with {with_flag}"
        )


def _by_looks(
    session: Session, console: Console, settings: Settings, crew: Crew, target: Target
) -> Tracked:
    """The platform followed by its own features."""
    from freeswing.calib.camera.cameras_file import read_cameras
    from freeswing.cdpr.files.documents import InputError
    from freeswing.vision.untagged.track_untagged import track_untagged

    if target.untagged is None:
        raise InputError(
            f"{session.target}: --no-tags needs [untagged]: rest (images of the platform at rest), "
            "clicks (named points marked there) and [[untagged.points]] (where they are on it)"
        )
    return track_untagged(
        session.video_runs,
        read_cameras(session.cameras),
        target.untagged,
        results=session.results,
        frame_rate_hz=session.frame_rate_hz,
        settings=settings,
        workers=crew.processes,
        progress=console.progress,
    )


def _made(found: Tracked, session: Session, console: Console) -> Made:
    """What is written of tracked runs, and what is said of them."""
    from freeswing.cdpr.files.trajectory_csv import csv_pieces
    from freeswing.results.tracking import Tracking
    from freeswing.session.made import Made

    document = Tracking.from_json(found.document)
    if found.refused is None:
        _summarise(document, console)
    tracks = [
        (session.tracks / f"{name}.csv", partial(csv_pieces, trajectory))
        for name, trajectory in found.trajectories.items()
    ]
    return Made((("tracking.json", document),), tuple(tracks), found.refused)


def _whence(session: Session) -> str:
    """Where cameras come from: recordings of a board, or another program."""
    source = session.calibration
    if source is not None and source.recordings is not None:
        return "run freeswing calibrate first"
    return (
        "the session names no recordings of a board to calibrate from ([calibration]): give them, "
        "or bring cameras.toml from another program by freeswing convert; one camera above a bench "
        "needs none: freeswing track --planar, or planar = true in session.toml"
    )


def _draw(session: Session, console: Console, *, view: bool, overlay: bool) -> None:
    """The pictures of a tracked session."""
    from freeswing.calib.camera.cameras_file import read_cameras
    from freeswing.session.load_swings import load_target
    from freeswing.session.load_tracking import found_cameras
    from freeswing.vision.show.overlay import write_overlay
    from freeswing.vision.show.rerun_view import write_view
    from freeswing.vision.tracked_runs import tracked_run

    target = load_target(session)
    if target is None:
        return
    found = found_cameras(session)
    runs = [
        tracked_run(
            run,
            read_cameras(session.cameras),
            target,
            found,
            results=session.results,
            base_tags=session.calibration.base_tags if session.calibration else (),
            frame_rate_hz=session.frame_rate_hz,
        )
        for run in session.video_runs
    ]
    if view:
        write_view(session.results / "tracking.rrd", runs)
        console.say(f"  {session.results / 'tracking.rrd'}: open it with rerun")
    pairs = [(run, seen) for run in runs for seen in run.cameras] if overlay else []
    for k, (run, seen) in enumerate(pairs):
        console.progress(f"overlay {run.name} {seen.camera.name}", k / len(pairs))
        path = session.results / "overlay" / run.name / f"{seen.camera.name}.mp4"
        write_overlay(path, run, seen)
        console.say(f"  {path}")


def _write_clocks(session: Session, console: Console) -> None:
    """cameras.toml with the clocks that the runs agree on; tracks made before are then old."""
    from freeswing.calib.camera.cameras_file import read_cameras, write_cameras
    from freeswing.session.load_tracking import found_cameras
    from freeswing.vision.rig.kept_clocks import with_kept_clocks

    told = found_cameras(session)
    cameras, said = with_kept_clocks(read_cameras(session.cameras), told.seen, told.findings)
    write_cameras(session.cameras, cameras)
    for text in said or ["no clock was found off: cameras.toml stays"]:
        console.say(f"  {text}")


def _summarise(document: Tracking, console: Console) -> None:
    from freeswing.report.words import number, plain

    for run in document.runs:
        console.say(
            f"  {run.run}: {run.known} of {run.samples} samples, "
            f"{number(run.reprojection_px)} px, cameras agree to {number(run.consistency_mm)} mm"
        )
        for problem in run.problems:
            console.say(f"    {problem}")
    for effect in document.effects:
        values = ", ".join(f"{p.name} {number(p.value, 4)}" for p in effect.parameters)
        console.say(f"  {effect.run} {effect.camera}: {plain(effect.effect)} removed ({values})")
