"""Calibrate the cameras, their clocks and the base frame from recordings of a board."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial
from typing import TYPE_CHECKING, Any

from freeswing.commands.arguments import add_session, open_session
from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.calib.calibrate import CalibrationResult
    from freeswing.calib.rig.tie_by_swings import SwingFilms
    from freeswing.session.made import Made
    from freeswing.session.session_file import Session
    from freeswing.workers.crew import Crew


def add_arguments(parser: ArgumentParser) -> None:
    """The session and the lens model."""
    add_session(parser)
    models = ("PINHOLE", "OPENCV", "FULL_OPENCV", "OPENCV_FISHEYE")
    parser.add_argument("--model", choices=models, default="OPENCV", help="default OPENCV")
    text = "adjust the same corners by COLMAP as well, and say where the two differ"
    seen = "tie the cameras by images of the laboratory ([calibration.scene]) instead of a board"
    parser.add_argument("--scene", action="store_true", help=seen)
    parser.add_argument("--check-with", choices=("pycolmap",), help=text)


def run(options: Namespace, console: Console) -> None:
    """Calibrate, write cameras.toml and results/calibration.json."""
    from freeswing.session.stages import CALIBRATE

    session = open_session(options)
    settings = {"model": options.model}
    if options.check_with:
        settings["check_with"] = options.check_with
    if options.scene:
        settings["scene"] = True
    result = CALIBRATE.take(session, console, settings)
    console.say(str(session.cameras))
    console.show_file(result)


def make(session: Session, console: Console, settings: dict[str, Any], crew: Crew) -> Made:
    """calibration.json as a document, and cameras.toml where it may be used."""
    from freeswing.calib.calibrate import KEPT_BOARDS, Aids, PlumbLine, calibrate_session
    from freeswing.cdpr.files.documents import InputError
    from freeswing.cdpr.files.robot_file import read_robot

    source = session.calibration
    _tell_unreadable(session, console)
    if settings.get("scene") or (source and source.scene and source.recordings is None):
        return _made(_by_scene(session, console, settings), session, console, {})
    if source is None or source.recordings is None or source.board is None:
        raise InputError(f"{session.path}: [calibration] names no recordings and no board")
    plumb_line = None
    if source.plumb_line is not None:
        plumb_line = PlumbLine(source.plumb_line, read_robot(session.robot).gravity_m_s2)
    found = calibrate_session(
        source.recordings,
        source.board,
        source.base_tags,
        frame_rate_hz=session.frame_rate_hz,
        kept_boards=session.results / KEPT_BOARDS,
        model=settings["model"],
        beside=Aids(plumb_line, partial(_swings, session), source.surveyed, source.points),
        progress=console.progress,
    )
    checked = settings.get("check_with") and found.refused is None
    return _made(found, session, console, _beside_colmap(found, console) if checked else {})


def _by_scene(session: Session, console: Console, settings: dict[str, Any]) -> CalibrationResult:
    """The cameras tied by what the laboratory looks like."""
    from freeswing.calib.scene.calibrate_scene import KEPT_SCENE, calibrate_scene
    from freeswing.cdpr.files.documents import InputError

    source = session.calibration
    if source is None or source.scene is None:
        raise InputError(
            f"{session.path}: --scene needs [calibration.scene]: frames (each camera's recording "
            "of the laboratory at rest) and walk (stills of a camera carried through it)"
        )
    if settings.get("check_with"):
        raise InputError("--check-with is for boards: --scene starts from COLMAP itself")
    return calibrate_scene(
        source.scene,
        source.base_tags,
        session.results / KEPT_SCENE,
        model=settings["model"],
        progress=console.progress,
    )


def _made(
    found: CalibrationResult, session: Session, console: Console, beside: dict[str, Any]
) -> Made:
    """What is written of a calibration, and what is said of it."""
    from freeswing.calib.camera.cameras_file import cameras_text
    from freeswing.results.calibration import Calibration
    from freeswing.session.made import Made

    if found.refused is not None:
        explained = Calibration.from_json(found.document)
        return Made((("calibration.json", explained),), refused=found.refused)
    document = Calibration.from_json({**found.document, **beside})
    seen = "points of the laboratory" if document.board.kind == "scene" else "views"
    for entry in document.cameras:
        console.say(f"camera {entry.name}: {entry.views} {seen}, {entry.reprojection_px:.3f} px")
    vertical = document.vertical
    if vertical is not None and vertical.verdict == "agrees":  # else it is among the warnings
        console.say(vertical.sentence)
    for warning in document.verdict.warnings if document.verdict else ():
        console.complain(warning)
    files = ((session.cameras, cameras_text(found.cameras).encode()),)
    return Made((("calibration.json", document),), files)


def _tell_unreadable(session: Session, console: Console) -> None:
    """Files of the session that only later commands need, wrong: said here, before those refuse."""
    from freeswing.cdpr.files.documents import InputError
    from freeswing.session.load_swings import load_robot, load_target

    for load in (load_robot, load_target):
        try:
            load(session)
        except InputError as error:
            console.complain(f"{error}; cameras can be calibrated, track and identify will refuse")


def _swings(session: Session) -> SwingFilms | None:
    """The runs' recordings, where the session has some and tags on the platform."""
    from freeswing.calib.board.platform_as_board import platform_tags
    from freeswing.calib.calibrate import KEPT_BOARDS
    from freeswing.calib.rig.tie_by_swings import SwingFilms
    from freeswing.session.load_swings import load_target

    runs = tuple(
        (run.name, run.video)
        for run in session.video_runs
        if run.video is not None and run.video.is_dir() and any(run.video.iterdir())
    )
    target = load_target(session) if runs else None
    tags = None if target is None else platform_tags(target)
    return None if tags is None else SwingFilms(tags, runs, session.results / KEPT_BOARDS)


def _beside_colmap(found: CalibrationResult, console: Console) -> dict[str, Any]:
    """What COLMAP's solution adds to the document; tells what came of it."""
    from freeswing.calib.verdict.colmap_check import beside_colmap, complaints, document

    if found.rig.is_tied_by_swings:
        console.complain(
            "the swings tie these cameras, and COLMAP is shown the board alone: not compared"
        )
        return {}
    beside = beside_colmap(found.rig)
    for one in beside:
        console.say(
            f"camera {one.camera} by COLMAP: focal length {100 * one.focal:+.3f} % (ours is known "
            f"to {100 * one.focal_std:.3f} %), place {one.place_mm:.2f} mm, direction "
            f"{one.turn_mrad:.2f} mrad away"
        )
    verdict = found.document["verdict"]
    warned = {**verdict, "warnings": [*verdict["warnings"], *complaints(beside)]}
    return {"beside_colmap": document(beside), "verdict": warned}
