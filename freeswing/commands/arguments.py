"""Flags that several commands share."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from freeswing.session import Session


def add_session(parser: ArgumentParser) -> None:
    """The session and where its results go."""
    parser.add_argument("session", metavar="SESSION", help="a session's folder or session.toml")
    add_results(parser, "SESSION/results")


def add_results(parser: ArgumentParser, usual: str) -> None:
    """Where results go."""
    text = f"write everything to DIR instead of {usual} (for read-only folders)"
    parser.add_argument("--results", metavar="DIR", help=text)


def add_workers(parser: ArgumentParser) -> None:
    """How many processes work side by side."""
    parser.add_argument(
        "--workers", type=int, default=0, metavar="N", help="processes; default one a core"
    )


def open_session(options: Namespace) -> Session:
    """The session that the flags of `add_session` name."""
    from freeswing.session import read_session

    return read_session(options.session, options.results)
