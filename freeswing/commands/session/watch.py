"""Watch a session: what a new recording makes stale is done again, the page refreshes itself."""

from __future__ import annotations

import time
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from freeswing.commands.arguments import (
    add_session,
    add_workers,
    crew_of,
    open_session,
    positive,
)
from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.session.new_recordings import Mark
    from freeswing.session.session_file import Session

PAGE_S = 3.0  # how often the page is read anew while it is watched


def add_arguments(parser: ArgumentParser) -> None:
    """The session, and how much is done each time."""
    add_session(parser)
    add_workers(parser)
    parser.add_argument(
        "--diagnose", action="store_true", help="look for missing effects each time too: minutes"
    )
    parser.add_argument(
        "--no-add", action="store_true", help="leave recordings that session.toml does not name"
    )
    parser.add_argument("--every-s", type=positive, default=1.0, help="looks, default 1 s apart")
    parser.add_argument("--open", action="store_true", help="show the page in a browser")


def run(options: Namespace, console: Console) -> None:
    """Until interrupted (ctrl-c): look, wait until files have settled, redo, show."""
    from freeswing.commands.session.report import open_page, write_report

    session = open_session(options)
    seen = Seen.of(session)  # before anything is computed: what comes meanwhile is new
    try:
        _redo(session, options, console)
        if options.open:
            open_page(session.results / "report.html", console)
        follow(options, console, lambda: time.sleep(options.every_s), seen)
    except KeyboardInterrupt:
        console.say("no longer watched")
    finally:
        write_report(open_session(options))  # one that does not read itself anew
    console.say_json({"format": "freeswing-watch/1", "page": str(session.results / "report.html")})


@dataclass(frozen=True, slots=True)
class Seen:
    """What was there at a moment: a mark of every file, and the recordings."""

    files: Mark
    recordings: frozenset[Path]

    @classmethod
    def of(cls, session: Session) -> Seen:
        """As it is now."""
        from freeswing.session.new_recordings import mark, recordings

        return cls(mark(session), frozenset(recordings(session)))


def follow(options: Namespace, console: Console, wait: Callable[[], None], seen: Seen) -> None:
    """Look again and again; `wait` ends it by KeyboardInterrupt.

    Args:
        options: as `run` takes them.
        console: where it is said.
        wait: between two looks.
        seen: what was there when the results were last begun.
    """
    from freeswing.cdpr.files.documents import InputError
    from freeswing.session.new_recordings import mark

    session = open_session(options)
    done = last = seen.files
    while True:
        wait()
        now = mark(session)
        is_settled, last = now == last, now
        if now == done or not is_settled:
            continue
        try:
            session = open_session(options)
            if not options.no_add:
                session = _take_in(session, seen.recordings, options, console)
            _say_changes(done, now, console)
            done = last = mark(session)  # what changes while it computes is seen after it
            _redo(session, options, console)
        except InputError as failure:  # a file half edited: the next look may find it whole
            console.complain(str(failure))
            done = last = now


def _take_in(
    session: Session, known: frozenset[Path], options: Namespace, console: Console
) -> Session:
    from freeswing.session.new_recordings import recordings, take_in

    names = take_in(session, recordings(session) - known)
    if not names:
        return session
    console.say(f"new in {session.path}: run {', '.join(names)}")
    return open_session(options)


def _say_changes(before: Mark, now: Mark, console: Console) -> None:
    changed = sorted(name for name in {**before, **now} if before.get(name) != now.get(name))
    more = f" and {len(changed) - 3} more" if len(changed) > 3 else ""
    console.say(f"changed: {', '.join(changed[:3])}{more}")


def _redo(session: Session, options: Namespace, console: Console) -> None:
    """What is stale, and the page; what cannot be computed is said and waited over."""
    from freeswing.cdpr.files.documents import DataError, InputError
    from freeswing.commands.session.run import run_session
    from freeswing.session.stages import DIAGNOSE, STAGES

    stages = tuple(one for one in STAGES if options.diagnose or one is not DIAGNOSE)
    try:
        with crew_of(options, session) as crew:
            run_session(session, console, crew, stages, PAGE_S)
    except (DataError, InputError) as failure:
        console.complain(str(failure))
