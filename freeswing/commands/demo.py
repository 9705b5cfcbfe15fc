"""Make a recorded sample session and take it all the way to the report."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from freeswing.console import Console


def add_arguments(parser: ArgumentParser) -> None:
    """Where to, and the seed."""
    parser.add_argument(
        "folder", metavar="DIR", nargs="?", default="freeswing-demo", help="default freeswing-demo"
    )
    parser.add_argument("--seed", type=int, default=1, help="another seed, another session")


def run(options: Namespace, console: Console) -> None:
    """Record, solve, and end with the report's path."""
    from cdpr.documents import InputError
    from freeswing.commands.run import run_session
    from freeswing.demo.mocap import write_mocap_session
    from freeswing.session import read_session

    folder = Path(options.folder)
    if folder.exists() and not (folder / "truth.json").is_file() and any(folder.iterdir()):
        raise InputError(f"{folder}: holds other files; name a new folder")
    console.say(f"recording a session into {folder} (its truth.json is not read by what follows)")
    session = read_session(write_mocap_session(folder, options.seed, console.progress))
    run_session(session, console)
    console.show_file(session.results / "identification.json")
