"""Calibrate the cameras, their clocks and the base frame from recordings of a board."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING, Any

from freeswing.commands.arguments import add_session, open_session
from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.crew import Crew
    from freeswing.session import Session


def add_arguments(parser: ArgumentParser) -> None:
    """The session and the lens model."""
    add_session(parser)
    models = ("PINHOLE", "OPENCV", "FULL_OPENCV", "OPENCV_FISHEYE")
    parser.add_argument("--model", choices=models, default="OPENCV", help="default OPENCV")


def run(options: Namespace, console: Console) -> None:
    """Calibrate, write cameras.toml and results/calibration.json."""
    from freeswing.stages import CALIBRATE

    session = open_session(options)
    result = CALIBRATE.take(session, console, {"model": options.model})
    console.say(str(session.cameras))
    console.show_file(result)


def make(
    session: Session, console: Console, settings: dict[str, Any], crew: Crew
) -> list[tuple[str, dict[str, Any]]]:
    """cameras.toml on disk, and calibration.json as a document."""
    from calib.calibrate import calibrate_session
    from cdpr.documents import InputError

    source = session.calibration
    if source is None or source.recordings is None or source.board is None:
        raise InputError(f"{session.path}: [calibration] names no recordings and no board")
    found = calibrate_session(
        source.recordings,
        source.board,
        source.base_tags,
        frame_rate_hz=session.frame_rate_hz,
        cameras_path=session.cameras,
        results_folder=session.results,
        model=settings["model"],
        progress=console.progress,
    )
    for entry in found.document["cameras"]:
        console.say(
            f"camera {entry['name']}: {entry['views']} views, {entry['reprojection_px']:.3f} px"
        )
    for warning in found.document["verdict"]["warnings"]:
        console.complain(warning)
    return [("calibration.json", found.document)]
