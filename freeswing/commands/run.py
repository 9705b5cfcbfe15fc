"""Do everything that is missing or out of date, up to the report."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from freeswing.commands.arguments import add_session, add_workers, crew_of, open_session
from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.session.session_file import Session
    from freeswing.workers.crew import Crew


def add_arguments(parser: ArgumentParser) -> None:
    """The session."""
    add_session(parser)
    add_workers(parser)


def run(options: Namespace, console: Console) -> None:
    """Take each step that is due; the page is always written anew."""
    session = open_session(options)
    with crew_of(options, session) as crew:
        run_session(session, console, crew)
    console.show_file(session.results / "identification.json")


def run_session(session: Session, console: Console, crew: Crew) -> None:
    """All steps of a session, then the report, whose path is said last."""
    from freeswing.commands.report import write_report
    from freeswing.session.stages import STAGES

    for stage in STAGES:
        if not stage.due(session):
            continue
        if stage.is_current(session):
            console.say(f"{stage.name}: up to date")
        else:
            console.say(f"{stage.name}:")
            stage.take(session, console, crew=crew)
    console.say(str(write_report(session)))
