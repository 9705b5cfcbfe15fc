"""Put all results into one self-contained page, results/report.html."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from freeswing.commands.arguments import add_session, open_session
from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.session.session_file import Session


def add_arguments(parser: ArgumentParser) -> None:
    """The session."""
    add_session(parser)


def run(options: Namespace, console: Console) -> None:
    """Render what results there are."""
    page = write_report(open_session(options))
    console.say(str(page))
    console.say_json({"format": "freeswing-report/1", "page": str(page)})


def write_report(session: Session) -> Path:
    """Render the page; gives its path."""
    from freeswing.report.material import read_material
    from freeswing.report.page import write_page

    page = session.results / "report.html"
    notes = _findings(session.results / "check.json")
    write_page(page, read_material(session.name, session.results, notes))
    return page


def _findings(path: Path) -> tuple[str, ...]:
    """What `freeswing check` found, where it has been run."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))["findings"]
        return tuple(f"{one['level']} {one['subject']}: {one['text']}" for one in found)
    except (OSError, ValueError, KeyError, TypeError):
        return ()
