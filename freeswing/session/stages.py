"""The steps from recordings to the report: what each reads, what it writes, when it is due."""

from __future__ import annotations

import importlib
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from freeswing.cdpr.files.documents import DataError
from freeswing.console import Console
from freeswing.results.codec import Document
from freeswing.session.load_swings import trajectory_path
from freeswing.session.made import Made, write_made
from freeswing.session.provenance import hashes, is_current, provenance
from freeswing.session.session_file import Session
from freeswing.workers.crew import Crew

Make = Callable[[Session, Console, dict[str, Any], Crew], Made]


@dataclass(frozen=True, slots=True)
class Stage:
    """One step that a command of the same name takes.

    Attributes:
        name: of the command, whose module holds `make(session, console, settings, crew)`:
            it writes nothing and gives all that is to be written, the main document first.
        result: main result file below the results folder.
        inputs: what it reads.
        due: whether a session needs it at all.
        settings: those that `freeswing run` uses.
        others: its files beside the main one, which have to be there as they were written.
        whole: whether what it leaves for a person to edit is there and can be read.
    """

    name: str
    result: str
    inputs: Callable[[Session], list[Path]]
    due: Callable[[Session], bool]
    settings: dict[str, Any] = field(default_factory=dict)
    others: Callable[[Session], list[Path]] = lambda session: []
    whole: Callable[[Session], bool] = lambda session: True

    def is_current(self, session: Session) -> bool:
        """Whether all its files are there, whole, and made from what is there now."""
        result, others = session.results / self.result, self.others(session)
        made_of = self.inputs(session), self.settings, others
        return is_current(result, session, *made_of) and self.whole(session)

    def take(
        self,
        session: Session,
        console: Console,
        settings: dict[str, Any] | None = None,
        crew: Crew | None = None,
    ) -> Path:
        """Make the result from scratch and write it with its provenance.

        The crew (one process a core where None) does not change it.

        Raises:
            DataError: where what was made must not be used; it is written without provenance, so
                that the step stays due.
        """
        chosen = self.settings | (settings or {})
        # Inputs are hashed first: what changes meanwhile makes the result out of date.
        made_of = provenance(session, self.inputs(session), chosen)
        make: Make = importlib.import_module(f"freeswing.commands.session.{self.name}").make
        made = make(session, console, chosen, crew or Crew())
        if made.refused is not None:
            write_made(session.results, made)
            raise DataError(made.refused)
        (name, main), *beside = made.documents
        told = ((name, main), *((other, one.made_of(made_of)) for other, one in beside))

        def finished(document: Document) -> Document:
            others = hashes(session, self.others(session))
            return document.made_of({**made_of, "outputs": others} if others else made_of)

        return write_made(session.results, replace(made, documents=told), finished)


def _robot_files(session: Session) -> list[Path]:
    files = [session.path, session.robot, *([session.target] if session.target else [])]
    try:
        platform = tomllib.loads(session.robot.read_text(encoding="utf-8")).get("platform", {})
        mesh = platform.get("mesh") if isinstance(platform, dict) else None
    except (OSError, ValueError, RecursionError):
        return files
    return [*files, session.robot.parent / mesh] if isinstance(mesh, str) else files


def _calibration_files(session: Session) -> list[Path]:
    source = session.calibration
    scene = [] if source is None or source.scene is None else source.scene.files
    if source is None or source.recordings is None:
        return [session.path, *scene]
    judged = [] if source.plumb_line is None else [session.robot]  # by its gravity
    return [session.path, source.recordings, *judged, *scene]


def _tracking_files(session: Session) -> list[Path]:
    videos = [run.video for run in session.video_runs if run.video is not None]
    covariance = session.results / "calibration.json"
    looks = _looks_files(session)
    return [*_robot_files(session), session.cameras, covariance, *videos, *looks]


def _looks_files(session: Session) -> list[Path]:
    """Images and marks of a platform without tags."""
    from freeswing.cdpr.files.documents import InputError
    from freeswing.cdpr.measured.target import read_target

    try:
        untagged = None if session.target is None else read_target(session.target).untagged
    except InputError:
        return []  # said by those who need it
    return [] if untagged is None else [untagged.rest, untagged.clicks]


def _motion_files(session: Session) -> list[Path]:
    # Beside the tracks stands what the calibration may do to all of them.
    tracking = [session.results / "tracking.json"] if session.video_runs else []
    tracks = (trajectory_path(session, run) for run in session.runs)
    return [*_robot_files(session), *tracks, *tracking]


def _tracks(session: Session) -> list[Path]:
    return [trajectory_path(session, run) for run in session.video_runs]


def _has_its_cameras(session: Session) -> bool:
    """cameras.toml may be edited by hand; gone, cut short or emptied it is made again."""
    from freeswing.calib.camera.cameras_file import read_cameras
    from freeswing.cdpr.files.documents import InputError
    from freeswing.results.calibration import Calibration
    from freeswing.results.files import read_document

    try:
        made = read_document(session.results / "calibration.json", Calibration)
        known = {camera.name for camera in read_cameras(session.cameras)}
    except InputError:
        return False
    return made is not None and {camera.name for camera in made.cameras} <= known


def _is_diagnosed(session: Session) -> bool:
    """Where runs are held out, or where a bench leaves each out in turn."""
    from freeswing.session.load_bench import is_bench
    from freeswing.session.load_swings import load_robot

    if any(run.role == "validate" for run in session.runs):
        return True
    return is_bench(session, load_robot(session))


def _needs_calibration(session: Session) -> bool:
    """Cameras that came from elsewhere are not calibrated again."""
    source = session.calibration
    has_recordings = source is not None and (source.recordings or source.scene) is not None
    is_ours = (session.results / "calibration.json").is_file()
    return (
        has_recordings and bool(session.video_runs) and (is_ours or not session.cameras.is_file())
    )


CALIBRATE = Stage(
    "calibrate",
    "calibration.json",
    _calibration_files,
    _needs_calibration,
    {"model": "OPENCV"},
    whole=_has_its_cameras,
)
TRACK = Stage(
    "track",
    "tracking.json",
    _tracking_files,
    lambda session: bool(session.video_runs),
    {"correct_rig": True, "refine_layout": False},
    _tracks,
)
IDENTIFY = Stage(
    "identify",
    "identification.json",
    _motion_files,
    lambda session: True,
    {"weighting": "published", "likelihood": True},
    lambda session: [session.results / "motion.json"],
)
DIAGNOSE = Stage(
    "diagnose",
    "diagnosis.json",
    _motion_files,
    _is_diagnosed,
    {"only": None},
    lambda session: [session.results / "diagnosis_motion.json"],
)
STAGES = (CALIBRATE, TRACK, IDENTIFY, DIAGNOSE)
