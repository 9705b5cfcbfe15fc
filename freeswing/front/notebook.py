"""A session as Python works with it: the commands' own steps, quietly."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.cdpr.robot import Robot
from freeswing.commands.session.report import write_report
from freeswing.console import Console
from freeswing.front.found import Found, diagnosed, identified
from freeswing.results.codec import Document
from freeswing.results.diagnosis import Diagnosis
from freeswing.results.files import read_document
from freeswing.results.identification import Identification
from freeswing.results.motion import Motion
from freeswing.session.load_swings import load_robot, load_swing, load_target
from freeswing.session.marker_runs import read_marker_runs
from freeswing.session.session_file import Session, read_session
from freeswing.session.stages import DIAGNOSE, IDENTIFY, Stage
from freeswing.workers.crew import Crew


@dataclass(frozen=True, slots=True)
class LabSession:
    """A session on disk; its results are written as the commands write them.

    Attributes:
        session: session.toml, read.
    """

    session: Session

    @property
    def runs(self) -> tuple[str, ...]:
        """Names of the recorded swings."""
        return tuple(run.name for run in self.session.runs)

    def identify(self, **settings: Any) -> Found:
        """The inertial parameters; taken from the file where it is up to date.

        Args:
            settings: those of `freeswing identify`, such as `consistent=True`.

        Raises:
            InputError: a file is wrong.
            DataError: the data cannot give a result.
        """
        found = self._taken(IDENTIFY, Identification, settings, Crew())
        return identified(found, self._motion("motion.json"))

    def diagnose(self, *, workers: int = 0, only: tuple[str, ...] | None = None) -> Found:
        """What the model lacks, judged on held-out runs; taken from the file where up to date.

        Raises:
            InputError: a file is wrong.
            DataError: the data cannot give a result.
        """
        settings = {} if only is None else {"only": list(only)}
        found = self._taken(DIAGNOSE, Diagnosis, settings, Crew(workers))
        return diagnosed(found, self._motion("diagnosis_motion.json"))

    def robot(self) -> Robot:
        """The robot as declared."""
        return load_robot(self.session)

    def swing(self, name: str) -> Trajectory:
        """A recorded swing as poses or free coordinates, in the base frame.

        Raises:
            KeyError: no run of that name, with those there are.
            InputError: its file is wrong.
            DataError: it has not been tracked yet.
        """
        run = next((one for one in self.session.runs if one.name == name), None)
        if run is None:
            raise KeyError(f"{name}: not among {', '.join(self.runs)}")
        target = load_target(self.session)
        markers = read_marker_runs(self.session, target)
        return load_swing(self.session, run, self.robot(), target, markers).trajectory

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{escape(run.name)}</td><td>{run.role}</td></tr>" for run in self.session.runs
        )
        return f"<p>{escape(self.session.name)}</p><table>{rows}</table>"

    def report(self) -> Path:
        """Write the page of all results that there are; gives its path."""
        return write_report(self.session)[0]

    def _motion(self, name: str) -> Motion | None:
        return read_document(self.session.results / name, Motion)

    def _taken(self, stage: Stage, kind: type[Any], settings: dict[str, Any], crew: Crew) -> Any:
        path = self.session.results / stage.result
        if settings or not stage.is_current(self.session):
            path = stage.take(self.session, Console(quiet=True), settings, crew)
        document: Document | None = read_document(path, kind)
        return document


def open_lab(path: Path | str, results: Path | str | None = None) -> LabSession:
    """A session by its folder or session.toml.

    Raises:
        InputError: naming every problem of the file.
    """
    return LabSession(read_session(path, results))
