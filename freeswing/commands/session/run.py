"""Do everything that is missing or out of date, up to the report."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from freeswing.commands.arguments import add_session, add_workers, crew_of, open_session
from freeswing.console import Console

if TYPE_CHECKING:
    from pathlib import Path

    from freeswing.session.session_file import Session
    from freeswing.session.stages import Stage
    from freeswing.workers.crew import Crew


NEEDED = ("calibrate", "track")  # without their results what follows cannot begin


def add_arguments(parser: ArgumentParser) -> None:
    """The session."""
    add_session(parser)
    add_workers(parser)


def run(options: Namespace, console: Console) -> None:
    """Take each step that is due; the page is always written anew."""
    from freeswing.session.drive_session import drive_path

    driven = drive_path(options.session)
    if driven is not None:
        _run_driven(driven, options.results, console)
        return
    session = open_session(options)
    with crew_of(options, session) as crew:
        run_session(session, console, crew)
    console.show_file(session.results / "identification.json")


def _run_driven(path: Path, results: str | None, console: Console) -> None:
    """Estimate, look for what is missing, and the page of both."""
    from freeswing.commands.session import drive
    from freeswing.commands.session.report import driven_page
    from freeswing.session.drive_session import read_drive_session

    drive.identify(read_drive_session(path, results), console)
    drive.diagnose(path, results, None, console)
    page, material = driven_page(path, results)
    for warning in material.warnings:
        console.complain(warning)
    console.say(str(page))


def run_session(
    session: Session,
    console: Console,
    crew: Crew,
    stages: Sequence[Stage] | None = None,
    refresh_s: float | None = None,
    lessons: Mapping[str, str] | None = None,
) -> None:
    """All steps of a session, then the report, whose path is said last.

    Args:
        session: whose steps are taken.
        console: where it is said.
        crew: who works.
        stages: those that are taken where they are due; None: all.
        refresh_s: the page reads itself anew so often; None: it stays as it is.
        lessons: what a step is for, by its name.

    Raises:
        DataError: where a step came to no result; the report is written all the same and says so.
        InputError: the same, where a file is wrong.
    """
    from freeswing.cdpr.files.documents import DataError, InputError
    from freeswing.commands.session.report import NO_VALIDATION, write_report
    from freeswing.session.stages import DIAGNOSE, STAGES

    failures: dict[str, DataError | InputError] = {}
    for stage in STAGES if stages is None else stages:
        try:
            if stage.due(session):
                _take(stage, session, console, crew, (lessons or {}).get(stage.name, ""))
            elif stage is DIAGNOSE:
                console.say(f"diagnose: left out. {NO_VALIDATION}")
        except (DataError, InputError) as failure:
            failures[stage.name] = failure
            if stage.name in NEEDED:
                break
    told = {name: str(one) for name, one in failures.items()}
    page, material = write_report(session, told, refresh_s)
    for warning in material.warnings:
        console.complain(warning)
    console.say(str(page))
    if failures:
        told = "\n  ".join(f"{name}: {why}" for name, why in failures.items())
        wrong = next((one for one in failures.values() if isinstance(one, InputError)), None)
        if wrong is not None:
            raise InputError(told) from wrong
        raise DataError(told) from next(iter(failures.values()))


def _take(stage: Stage, session: Session, console: Console, crew: Crew, lesson: str) -> None:
    if stage.is_current(session):
        console.say(f"{stage.name}: up to date")
        return
    console.say(f"{stage.name}: {lesson}".rstrip())
    stage.take(session, console, crew=crew)
