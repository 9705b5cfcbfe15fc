"""Put all results into one self-contained page, results/report.html."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from freeswing.commands.arguments import add_session, open_session
from freeswing.console import Console


def add_arguments(parser: ArgumentParser) -> None:
    """The session."""
    add_session(parser)


def run(options: Namespace, console: Console) -> None:
    """Render what results there are."""
    from freeswing.report.material import read_material
    from freeswing.report.page import write_page

    session = open_session(options)
    page = session.results / "report.html"
    write_page(page, read_material(session.name, session.results))
    console.say(str(page))
