"""Make a recorded sample session and take it all the way to the report."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from freeswing.commands.arguments import add_workers, crew_of, whole
from freeswing.console import Console


def add_arguments(parser: ArgumentParser) -> None:
    """Where to, and the seed."""
    parser.add_argument(
        "folder", metavar="DIR", nargs="?", default="freeswing-demo", help="default freeswing-demo"
    )
    parser.add_argument(
        "--mocap", action="store_true", help="motion capture instead of cameras: quicker"
    )
    add_workers(parser)
    parser.add_argument("--open", action="store_true", help="show the report in a browser")
    parser.add_argument("--seed", type=whole, default=1, help="another seed, another session")


def run(options: Namespace, console: Console) -> None:
    """Record, solve, and end with the report's path."""
    from freeswing.cdpr.files.documents import InputError
    from freeswing.commands.session.report import open_page
    from freeswing.commands.session.run import run_session
    from freeswing.demo.lessons import LESSONS
    from freeswing.session.session_file import read_session

    folder = Path(options.folder)
    folder = folder.resolve() if options.cluster else folder
    if folder.exists() and not (folder / "truth.json").is_file() and any(folder.iterdir()):
        raise InputError(f"{folder}: holds other files; name a new folder")
    console.say(f"recording a session into {folder} (its truth.json is not read by what follows)")
    with _compiled_beside(options):
        session = read_session(_record(folder, options, console))
        with crew_of(options, session) as crew:
            run_session(session, console, crew, lessons=LESSONS)
    if options.open:
        open_page(session.results / "report.html", console)
    console.show_file(session.results / "identification.json")


def _compiled_beside(options: Namespace) -> AbstractContextManager[None]:
    if options.mocap:  # compiles little
        return nullcontext()
    from freeswing.demo.rehearsal import rehearsed

    return rehearsed()


def _record(folder: Path, options: Namespace, console: Console) -> Path:
    if options.mocap:
        from freeswing.demo.mocap import write_mocap_session

        return write_mocap_session(folder, options.seed, console.progress)
    from freeswing.demo.filmed import write_filmed_session

    return write_filmed_session(folder, options.seed, console.progress)
