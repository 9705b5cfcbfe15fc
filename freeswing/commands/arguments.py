"""Flags that several commands share."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from freeswing.session.session_file import Session
    from freeswing.workers.crew import Crew


def add_session(parser: ArgumentParser) -> None:
    """The session and where its results go."""
    parser.add_argument("session", metavar="SESSION", help="a session's folder or session.toml")
    add_results(parser, "SESSION/results")


def add_results(parser: ArgumentParser, usual: str) -> None:
    """Where results go."""
    text = f"write everything to DIR instead of {usual} (for read-only folders)"
    parser.add_argument("--results", metavar="DIR", help=text)


def add_workers(parser: ArgumentParser) -> None:
    """Who works side by side."""
    parser.add_argument(
        "--workers", type=int, default=0, metavar="N", help="processes; default one a core"
    )
    parser.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help="hand recordings and refits to the Dask cluster whose scheduler is there",
    )


def open_session(options: Namespace) -> Session:
    """The session that the flags of `add_session` name."""
    from freeswing.session.session_file import read_session

    session, results = options.session, options.results
    if getattr(options, "cluster", None):  # whose workers start in other folders
        session, results = Path(session).resolve(), results and Path(results).resolve()
    return read_session(session, results)


def crew_of(options: Namespace, session: Session) -> AbstractContextManager[Crew]:
    """Those whom the flags of `add_workers` name."""
    from freeswing.workers.crew import crew_for

    return crew_for(session, options.workers, options.cluster)
