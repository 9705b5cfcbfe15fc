"""The command `freeswing`: flags, the choice of a command, and the one place where failures end."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Sequence
from types import ModuleType

from freeswing import __version__
from freeswing.console import Console

# Each command with the room of `freeswing/commands` that its file stands in, as help lists them.
COMMANDS = {
    "demo": "session",
    "new": "session",
    "check": "session",
    "calibrate": "session",
    "track": "session",
    "identify": "session",
    "diagnose": "session",
    "report": "session",
    "compare": "session",
    "run": "session",
    "convert": "files",
    "export": "files",
    "simulate": "robot",
    "linearise": "robot",
    "drive": "session",
    "effects": "robot",
    "board": "files",
    "home": "robot",
    "excite": "robot",
    "design": "control",
    "servo": "control",
    "tensions": "control",
}
DONE, NO_RESULT, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit status is 0 done, 1 no result from the data, 2 wrong input.

    Args:
        arguments: the words after `freeswing`; those of the process when None.
    """
    options = build_parser().parse_args(arguments)
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        # Processes share the cores; small matrices only lose by threads of their own.
        os.environ.setdefault(threads, "1")
    with Console(as_json=options.json, quiet=options.quiet) as console:
        try:
            options.run(options, console)
            sys.stdout.flush()
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        except KeyboardInterrupt:
            console.complain("interrupted; the results that were there before are untouched")
            return INTERRUPTED
        except Exception as failure:
            if options.verbose:
                raise
            console.complain(describe(failure))
            return exit_status(failure)
    return DONE


def exit_status(failure: BaseException) -> int:
    """2 for a file or a flag that is wrong, 1 for data that cannot give a result."""
    from freeswing.cdpr.files.problems import InputError

    unusable_file = isinstance(failure, OSError) and failure.filename is not None
    return WRONG_INPUT if isinstance(failure, InputError) or unusable_file else NO_RESULT


def describe(failure: BaseException) -> str:
    """One plain sentence for a failure; what is not ours to explain says how to learn more."""
    from freeswing.cdpr.files.problems import DataError, InputError

    if isinstance(failure, InputError | DataError):
        return str(failure)
    if isinstance(failure, OSError) and failure.strerror:
        where = f"{failure.filename}: " if failure.filename else ""
        return f"{where}{failure.strerror}"
    if isinstance(failure, MemoryError):
        return "the data do not fit into memory: shorten the windows or take fewer runs"
    if isinstance(failure, ValueError) and type(failure).__module__ != "numpy.linalg":
        return f"{failure}"
    kind = type(failure).__name__
    return f"{kind}: {failure} (not foreseen; --verbose shows where it happened)"


def build_parser() -> argparse.ArgumentParser:
    """The parser of all commands; each file in `freeswing/commands` adds its own flags."""
    parser = argparse.ArgumentParser(
        prog="freeswing",
        description="Recorded free swings of a cable-suspended platform in; its inertial "
        "parameters, how far to trust them, and what the model still lacks, out.",
        epilog="Exit status: 0 done, 1 the data cannot give a result, "
        "2 wrong usage or an unreadable file.",
    )
    parser.add_argument("--version", action="version", version=f"freeswing {__version__}")
    choices = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, room in COMMANDS.items():
        _add_command(choices, name, importlib.import_module(f"freeswing.commands.{room}.{name}"))
    return parser


def _add_command(choices: argparse._SubParsersAction, name: str, command: ModuleType) -> None:
    summary = (command.__doc__ or "").strip().splitlines()[0]
    parser = choices.add_parser(name, help=summary.rstrip("."), description=summary)
    command.add_arguments(parser)
    common = parser.add_argument_group("common to all commands")
    common.add_argument("--json", action="store_true", help="print the result file on stdout")
    common.add_argument("--quiet", action="store_true", help="no progress and no summary")
    common.add_argument("--verbose", action="store_true", help="show the traceback of a failure")
    parser.set_defaults(run=command.run)


if __name__ == "__main__":
    sys.exit(main())
